"""Changes of kept scans by many workers."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import voxtile
from test_remapping import wall_with_passer_by
from voxtile import errors

distributed = pytest.importorskip("distributed")
voxtile_dask = pytest.importorskip("voxtile.dask")

OPTIONS: dict[str, Any] = {"resolution": 0.25, "tile_size": 2.0, "max_range": 4.0, "keep_scans": True}
BOX = [[-2.0, -9.0, -9.0], [1.5, 9.0, 0.5]]
FAR = [[90.0, 90.0, 90.0], [91.0, 91.0, 91.0]]

# Changes: a function of `voxtile` and `voxtile.dask`, and its arguments.
CHANGES: dict[str, tuple[str, tuple[Any, ...], dict[str, Any]]] = {
    "one scan": ("remove_scans", (), {"scans": (5, 5)}),
    "most scans": ("remove_scans", (), {"scans": (3, 11)}),
    "an input": ("remove_scans", (), {"input": "drive"}),
    "a box": ("remove_points", (BOX,), {}),
    "a small box": ("remove_points", ([[3.0, -9, -9], [3.4, 9, 9]],), {}),
    "all points": ("remove_points", ([[-np.inf] * 3, [np.inf] * 3],), {}),
    "no point": ("remove_points", (FAR,), {}),
}


@pytest.fixture(scope="module", params=[1, 2, 4])
def client(request: pytest.FixtureRequest) -> Iterator[object]:
    cluster = distributed.LocalCluster(
        n_workers=request.param, threads_per_worker=1, processes=True, dashboard_address=None
    )
    with cluster, distributed.Client(cluster) as found:
        yield found


@pytest.fixture
def maps(drive: Path, tmp_path: Path) -> tuple[Path, Path]:
    """A map that keeps its scans, and a copy."""
    voxtile.build(drive, tmp_path / "map", clearing="guarded", **OPTIONS)
    shutil.copytree(tmp_path / "map", tmp_path / "one")
    return tmp_path / "map", tmp_path / "one"


def digests(map: Path) -> tuple[str, str]:
    return voxtile.digest(map), voxtile.scan_digest(map)


def without_counts(report: dict[str, Any]) -> dict[str, Any]:
    """What does not depend on the number of parts."""
    of_parts = {"parts", "parts_done_before", "scans_mapped", "updates_mapped", "tiles_mapped"}
    return {name: value for name, value in report.items() if name not in of_parts}


@pytest.mark.parametrize("change", CHANGES)
def test_removals_equal_those_of_one_process(client: object, change: str, maps: tuple[Path, Path]) -> None:
    map, one = maps
    name, arguments, keywords = CHANGES[change]
    before = digests(map)
    dry = getattr(voxtile_dask, name)(map, *arguments, **keywords, dry_run=True, client=client)
    assert digests(map) == before and dry["estimated_s"] is not None
    seen: list[tuple[int, int]] = []
    report = getattr(voxtile_dask, name)(
        map,
        *arguments,
        **keywords,
        region_size=4.0,
        keep_as="before",
        client=client,
        progress=lambda done, all: seen.append((done, all)),
    )
    wanted = getattr(voxtile, name)(one, *arguments, **keywords, keep_as="before")
    assert digests(map) == digests(one) and (digests(map) != before) == (change != "no point")
    assert without_counts(report) == without_counts(wanted)
    assert voxtile.verify(map)["findings"] == []
    if change != "no point":
        assert seen[-1] == (report["parts"], report["parts"]) and report["parts"] > 1
        assert voxtile.digest(map, snapshot="before") == before[0]
    assert not map.with_name("map.replay.parts").exists()
    # Removed points remain only in the snapshot.
    segments = [sorted((path / "scans").rglob("*")) for path in maps]
    assert len(segments[0]) == len(segments[1])


def test_snapshots_are_reported_and_deleted(client: object, maps: tuple[Path, Path]) -> None:
    map, one = maps
    for path in maps:
        voxtile.snapshot(path, "with")
    report = voxtile_dask.remove_scans(map, scans=(2, 3), region_size=4.0, client=client)
    assert report["snapshots_with_them"] == ["with"] and report["scans_removed"] == 2
    # The scans are gone, so nothing is replayed.
    report = voxtile_dask.remove_scans(map, scans=(2, 3), from_snapshots=True, client=client)
    assert report["snapshots_deleted"] == ["with"] and report["parts"] == 0
    voxtile.remove_scans(one, scans=(2, 3), from_snapshots=True)
    assert digests(map) == digests(one) and voxtile.snapshots(map) == []


def test_wrong_arguments_are_named(client: object, maps: tuple[Path, Path], drive: Path) -> None:
    map, _ = maps
    before = digests(map)
    remove: Any = voxtile_dask.remove_scans
    for keywords, named in (
        ({}, "scans"),
        ({"scans": (1, 2), "input": "x"}, "scans"),
        ({"scans": (40, 50)}, "scans"),
        ({"input": "other"}, "input"),
        ({"scans": (1, 2), "region_size": 0.5}, "region_size"),
        ({"scans": (1, 2), "keep_as": "a/b"}, "name"),
    ):
        with pytest.raises(errors.ArgumentError, match=named):
            remove(map, client=client, **keywords)
    with pytest.raises(errors.ArgumentError, match="region"):
        voxtile_dask.remove_points(map, [[1, 1, 1], [0, 2, 2]], client=client)
    voxtile.build(drive, map.with_name("without"), **{**OPTIONS, "keep_scans": False})
    for change in lambda path: remove(path, scans=(1, 2), client=client), lambda path: voxtile_dask.remove_points(
        path, BOX, client=client
    ):
        with pytest.raises(errors.ArgumentError, match="keeps no scans"):
            change(map.with_name("without"))
    assert digests(map) == before


def test_a_flush_meanwhile_is_an_error(
    client: object, maps: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    map, one = maps
    joined = voxtile.dask.replaying.join_replay

    def after_a_flush(*given: Any, **keywords: Any) -> Any:
        voxtile.remove_scans(map, scans=(7, 7))
        return joined(*given, **keywords)

    with monkeypatch.context() as patched:
        patched.setattr("voxtile.dask.replaying.join_replay", after_a_flush)
        with pytest.raises(errors.ChangedError):
            voxtile_dask.remove_scans(map, scans=(2, 3), region_size=4.0, client=client)
    voxtile_dask.remove_scans(map, scans=(2, 3), region_size=4.0, client=client)
    for scans in (7, 7), (2, 3):
        voxtile.remove_scans(one, scans=scans)
    assert digests(map) == digests(one)


# A client that is killed when it reaches a step, or after the step.
KILLED = """
import os, sys
import distributed, voxtile.dask
from voxtile.dask import replaying

def killed(*given, **keywords):
    if sys.argv[3] == "after":
        original(*given, **keywords)
    os.kill(os.getpid(), 9)

original = getattr(replaying, sys.argv[2])
setattr(replaying, sys.argv[2], killed)
if __name__ == "__main__":
    with distributed.Client(sys.argv[4]):
        name, arguments, keywords = eval(sys.argv[5], {"inf": float("inf")})
        getattr(voxtile.dask, name)(sys.argv[1], *arguments, region_size=4.0, **keywords)
"""


@pytest.mark.parametrize("change", ["one scan", "a box"])
def test_a_killed_client_is_resumed(change: str, maps: tuple[Path, Path], tmp_path: Path) -> None:
    map, one = maps
    name, arguments, keywords = CHANGES[change]
    (tmp_path / "killed.py").write_text(KILLED)
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
    with cluster, distributed.Client(cluster) as client:
        for step, when in (
            ("replay_columns", "before"),
            ("join_replay", "before"),
            ("join_replay", "after"),
        ):
            command = [sys.executable, "killed.py", map, step, when, cluster.scheduler_address]
            ended = subprocess.run([*command, repr((name, arguments, keywords))], cwd=tmp_path, check=False)
            assert ended.returncode == -signal.SIGKILL
            is_done = when == "after"
            assert (digests(map) == digests(one)) != is_done
            if step == "join_replay" and not is_done:
                # All parts are finished: a shard is damaged, named, and made again.
                parts = map.with_name("map.replay.parts")
                shard = next(path for path in sorted(parts.iterdir()) if path.is_dir())
                table = next(shard.rglob("*.bin"))
                table.write_bytes(table.read_bytes()[:-1])
                with pytest.raises(errors.VoxtileError, match=f"remove {shard} and"):
                    getattr(voxtile_dask, name)(map, *arguments, region_size=4.0, client=client, **keywords)
                shutil.rmtree(shard)
                shard.with_name(f"{shard.name}.json").unlink()
        # The change is committed; the same call removes the parts.
        report = getattr(voxtile_dask, name)(map, *arguments, region_size=4.0, client=client, **keywords)
        assert report["scans_changed"] == 0
        getattr(voxtile, name)(one, *arguments, **keywords)
        assert digests(map) == digests(one) and voxtile.verify(map)["findings"] == []
    assert not map.with_name("map.replay.parts").exists()


def test_a_resumed_call_uses_finished_parts(
    client: object, maps: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    map, one = maps
    with monkeypatch.context() as failing:
        failing.setattr("voxtile.dask.replaying.join_replay", lambda *_, **__: (_ for _ in ()).throw(OSError("x")))
        with pytest.raises(OSError, match="x"):
            voxtile_dask.remove_points(map, BOX, region_size=4.0, client=client)
    seen: list[object] = []
    report = voxtile_dask.remove_points(map, BOX, region_size=4.0, client=client, progress=lambda *_: seen.append(_))
    assert report["parts_done_before"] == report["parts"] > 1 and not seen
    voxtile.remove_points(one, BOX)
    assert digests(map) == digests(one)


@pytest.fixture
def walls(tmp_path: Path) -> tuple[Path, Path]:
    """A map of a wall that somebody passes in one scan and stands before in two others, and a copy."""
    how: Any = {"resolution": 0.2, "tile_size": 2.0, "max_range": 9.0, "clearing": "guarded", "keep_scans": True}
    with voxtile.Map.create(tmp_path / "map", **how) as map:
        for number in range(12):
            points = wall_with_passer_by(number)
            stands = (points[:, 1] > 1.0) & (number in (5, 6))
            points[stands] *= 0.5
            map.insert(points, pose=([0, 0, 0], [0, 0, 0, 1]))
    shutil.copytree(tmp_path / "map", tmp_path / "one")
    return tmp_path / "map", tmp_path / "one"


def moving_points(map: Path) -> int:
    scans = voxtile.scans(map)
    return sum(0 if scans.moving is None else int(scans.moving.sum()) for _ in scans)


def test_moving_points_are_those_of_one_process(client: object, walls: tuple[Path, Path]) -> None:
    map, one = walls
    before = digests(map)
    counts = []
    # The marks of the first call must not matter to the others.
    calls: list[dict[str, Any]] = [
        {},
        {"parked_scans": 2},
        {"region": [[-9, -9, -9], [9, 0, 9]]},
        {"parked_scans": 1},
        {"undo": True},
    ]
    for number, call in enumerate(calls):
        dry = voxtile_dask.clean(map, **call, dry_run=True, client=client)
        name = f"before_{number}"
        report = voxtile_dask.clean(map, **call, keep_as=name, region_size=4.0, client=client, memory="64MiB")
        wanted = voxtile.clean(one, **call)
        assert digests(map) == digests(one), call
        assert without_counts(report) == without_counts(wanted) and dry["scans_changed"] == wanted["scans_changed"]
        assert voxtile.verify(map)["findings"] == []
        counts.append(moving_points(map))
    # A thing that stays for two scans is parked.
    assert counts[0] > counts[1] > 0 and counts[0] > counts[2] > 0
    assert counts[3:] == [0, 0] and digests(map) == before
    assert not map.with_name("map.replay.parts").exists()
    for wrong in {"parked_scans": 0}, {"undo": True, "parked_scans": 2}:
        with pytest.raises(errors.ArgumentError, match=next(iter(wrong))):
            voxtile_dask.clean(map, **wrong, client=client)


def test_a_search_of_moving_points_is_resumed(
    client: object, walls: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    map, one = walls
    how: dict[str, Any] = {"parked_scans": 2, "region_size": 4.0, "client": client}

    def fail(*_: Any, **__: Any) -> None:
        raise OSError("x")

    for step in ("join", "replay_columns", "join_replay"):
        with monkeypatch.context() as failing:
            failing.setattr(f"voxtile.dask.replaying.{step}", fail)
            with pytest.raises(OSError, match="x"):
                voxtile_dask.clean(map, **how)
    parts = map.with_name("map.replay.parts")
    result = next(path for path in sorted(parts.glob("*.result")) if path.stat().st_size)
    content = bytearray(result.read_bytes())
    content[0] ^= 1
    result.write_bytes(content)
    with pytest.raises(errors.VoxtileError, match=f"{result}.*remove it and its text"):
        voxtile_dask.clean(map, **how)
    result.unlink()
    result.with_suffix(".json").unlink()
    seen: list[tuple[int, int]] = []
    report = voxtile_dask.clean(map, **how, progress=lambda *done: seen.append(done))
    # One search is made again.
    assert len(seen) == 1 and report["parts_done_before"] == report["parts"] > 1
    voxtile.clean(one, parked_scans=2)
    assert digests(map) == digests(one)


def test_killed_workers_do_not_change_the_result(drive: Path, tmp_path: Path) -> None:
    map, one = tmp_path / "map", tmp_path / "one"
    voxtile.build(drive, map, **OPTIONS)
    shutil.copytree(map, one)
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
    changes: list[Callable[[Any, Path, Any], Any]] = [
        lambda module, path, how: module.remove_scans(path, scans=(5, 6), **how),
        lambda module, path, how: module.remove_points(path, BOX, **how),
        lambda module, path, how: module.clean(path, parked_scans=3, **how),
    ]
    killed = 0
    with cluster, distributed.Client(cluster) as client:
        for change in changes:
            is_over = threading.Event()

            def kill(is_over: threading.Event = is_over) -> None:
                nonlocal killed
                while not is_over.wait(0.15):
                    processes = [worker.process for worker in list(cluster.workers.values())]
                    pids = [process.pid for process in processes if process is not None and process.pid]
                    if killed < 6 and pids:
                        os.kill(pids[killed % len(pids)], signal.SIGKILL)
                        killed += 1

            killer = threading.Thread(target=kill, daemon=True)
            killer.start()
            how = {"region_size": 2.0, "client": client}
            for _ in range(8):
                try:
                    change(voxtile_dask, map, how)
                    break
                except errors.VoxtileError as error:
                    assert "call again to resume" in str(error)
                    time.sleep(0.5)
            is_over.set()
            killer.join(10)
            change(voxtile, one, {})
            assert digests(map) == digests(one)
    assert killed > 0
