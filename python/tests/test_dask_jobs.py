"""Distributed operations on whole maps give the results of one process."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from concurrent.futures import CancelledError
from pathlib import Path

import numpy as np
import pytest
import voxtile
from conftest import matrix_of, scans_of
from voxtile import errors

distributed = pytest.importorskip("distributed")
voxtile_dask = pytest.importorskip("voxtile.dask")

OPTIONS = {"resolution": 0.25, "tile_size": 2.0, "max_range": 4.0}


@pytest.fixture(scope="module")
def client() -> Iterator[object]:
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
    with cluster, distributed.Client(cluster) as found:
        yield found


def _map(folder: Path, seed: int, shift: float = 0.0, **options: object) -> Path:
    """A map along a street."""
    has_intensities = options.get("sensor_model") == "iwlo"
    with voxtile.Map.create(folder, **{**OPTIONS, **options}) as made:
        for number, (points, pose) in enumerate(scans_of(seed, count=10)):
            pose[0] = 0.7 * number - 3.1 + shift
            made.insert(points, matrix_of(pose), intensities=np.ones(len(points), "f4") if has_intensities else None)
    return folder


@pytest.mark.parametrize("region_size", [4.0, 5.3, 1000.0, None])
def test_merge_and_decay_as_by_one_process(client: object, region_size: float | None, tmp_path: Path) -> None:
    maps = [_map(tmp_path / name, seed) for seed, name in enumerate(["a", "b", "c"], 1)]
    for prefer in (None, "last"):
        whole, parts = tmp_path / f"whole {prefer}", tmp_path / f"parts {prefer}"
        voxtile.merge(maps, whole, prefer=prefer)
        report = voxtile_dask.merge(maps, parts, prefer=prefer, region_size=region_size, client=client)
        assert voxtile.digest(parts) == voxtile.digest(whole)
        assert report["regions"] > 1
    before = voxtile.digest(maps[0])
    voxtile_dask.decay(maps[0], tmp_path / "faded", 5, forget_below=0.1, region_size=region_size, client=client)
    assert voxtile.digest(maps[0]) == before
    voxtile.decay(maps[0], 5, forget_below=0.1)
    assert voxtile.digest(tmp_path / "faded") == voxtile.digest(maps[0]) != before
    assert voxtile.verify(tmp_path / "faded")["findings"] == voxtile.verify(tmp_path / "parts last")["findings"] == []
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"a", "b", "c", "faded", "whole None", "whole last", "parts None", "parts last"}


@pytest.mark.parametrize(
    ("first", "second", "prefer"),
    [
        ({"storage": "compact"}, {}, None),
        ({"probabilities": [0.8, 0.4, 0.1, 0.9]}, {"storage": "compact"}, "first"),
        ({"sensor_model": "iwlo"}, {}, "last"),
    ],
)
def test_merge_uses_the_storage_of_the_first_map(
    client: object, first: dict[str, object], second: dict[str, object], prefer: str | None, tmp_path: Path
) -> None:
    maps = [_map(tmp_path / "a", 1, **first), _map(tmp_path / "b", 2, shift=9.0, **second)]
    voxtile.merge(maps, tmp_path / "whole", prefer=prefer)
    voxtile_dask.merge(maps, tmp_path / "parts", prefer=prefer, region_size=4.0, client=client)
    assert voxtile.digest(tmp_path / "parts") == voxtile.digest(tmp_path / "whole")
    assert [set(path.name for path in folder.glob("tile_*/*")) for folder in (tmp_path / "parts", maps[0])] == [
        set(path.name for path in folder.glob("tile_*/*")) for folder in (tmp_path / "whole", tmp_path / "parts")
    ]


def test_incompatible_maps_are_errors_without_output(client: object, tmp_path: Path) -> None:
    maps = [_map(tmp_path / "a", 1), _map(tmp_path / "b", 2, probabilities=[0.8, 0.4, 0.1, 0.9])]
    with pytest.raises(errors.VoxtileError, match="prefer"):
        voxtile_dask.merge(maps, tmp_path / "both", client=client)
    with pytest.raises(errors.ArgumentError, match="exists"):
        voxtile_dask.decay(maps[0], maps[1], 5, client=client)
    with pytest.raises(errors.ArgumentError, match="region_size"):
        voxtile_dask.decay(maps[0], tmp_path / "faded", 5, region_size=2.5, client=client)
    assert {path.name for path in tmp_path.iterdir()} == {"a", "b"}


def test_verify_finds_the_damage_that_one_process_finds(client: object, tmp_path: Path) -> None:
    source = _map(tmp_path / "map", 5)
    whole = voxtile.verify(source)
    assert voxtile_dask.verify(source, region_size=4.0, client=client) == whole and whole["damage"] == 0
    tables = sorted(source.glob("tile_*/iwlo_meta.bin"))
    for path in [tables[3], sorted(source.glob("tile_*/octree.bt"))[5]]:
        content = bytearray(path.read_bytes())
        content[len(content) // 2] ^= 1
        path.write_bytes(content)
    (source / "tile_77_0_0").mkdir()
    whole, found = voxtile.verify(source), voxtile_dask.verify(source, region_size=4.0, client=client)

    def sorted_findings(report: dict[str, object]) -> list[str]:
        return sorted(json.dumps(finding, sort_keys=True) for finding in report.pop("findings"))

    assert whole["damage"] >= 2 and sorted_findings(found) == sorted_findings(whole) and found == whole
    tables[0].unlink()
    (source / "commits.log").write_bytes(b"nothing")
    assert voxtile_dask.verify(source, client=client)["damage"] > 0
    with pytest.raises(errors.ArgumentError, match="^region_size: 1.0 m"):
        voxtile_dask.verify(_map(tmp_path / "sound", 5), region_size=1.0, client=client)
    with pytest.raises(errors.ArgumentError, match="but_tiles"):
        voxtile.verify(source, tiles=[(0, 0, 0)], but_tiles=True)


def test_a_map_is_rebuilt_from_its_scans_with_other_poses(client: object, tmp_path: Path) -> None:
    source = _map(tmp_path / "map", 7, keep_scans=True)
    poses = []
    for _, pose, _ in voxtile.scans(source):
        pose[1, 3] += 0.9
        poses.append(pose[:3].reshape(-1))
    np.savetxt(tmp_path / "moved.txt", poses, fmt="%.17g")
    poses_file = tmp_path / "moved.txt"
    voxtile_dask.build(source, tmp_path / "moved", poses=poses_file, client=client, region_size=4.0, **OPTIONS)
    before = voxtile.digest(source)
    voxtile.remap(source, [np.vstack([pose.reshape(3, 4), [0, 0, 0, 1]]) for pose in poses])
    assert voxtile.digest(tmp_path / "moved") == voxtile.digest(source) != before


@pytest.mark.parametrize("error", [CancelledError("enough"), KeyError("mine")])
def test_exceptions_of_the_callback_are_raised_unchanged(client: object, error: Exception, tmp_path: Path) -> None:
    source = _map(tmp_path / "map", 5)

    def fail(done: int, columns: int) -> None:
        raise error

    with pytest.raises(type(error), match=str(error.args[0])):
        voxtile_dask.decay(source, tmp_path / "faded", 5, client=client, progress=fail)
    # A task that is just writing its shard may still remove it.
    until = time.monotonic() + 10
    while len(list(tmp_path.iterdir())) > 1 and time.monotonic() < until:
        time.sleep(0.01)
    assert [path.name for path in tmp_path.iterdir()] == ["map"]


def test_a_tile_on_a_corner_of_four_regions_is_exported_to_all(client: object, tmp_path: Path) -> None:
    with voxtile.Map.create(tmp_path / "map", **OPTIONS) as made:
        # One tile, from 4 m to 6 m.
        made.insert(np.array([[x, y, 0.6] for x in (4.6, 5.4) for y in (4.6, 5.4)]), origin=[5.1, 5.1, 0.6])
    report = voxtile_dask.export(tmp_path / "map", tmp_path / "files", ".xyz", region_size=5.0, client=client)
    assert report["files"] == ["0_0.xyz", "0_1.xyz", "1_0.xyz", "1_1.xyz"]
    lines = [line for name in report["files"] for line in (tmp_path / "files" / name).read_text().splitlines()]
    voxtile.export(tmp_path / "map", tmp_path / "whole.xyz")
    assert sorted(lines) == sorted((tmp_path / "whole.xyz").read_text().splitlines()) and len(lines) == 4


def test_files_of_other_calls_are_not_used(client: object, tmp_path: Path) -> None:
    source, beside = _map(tmp_path / "map", 5), tmp_path / "files.unfinished"
    beside.mkdir()
    (beside / "7_7.csv").write_text("mine")
    with pytest.raises(errors.ArgumentError, match="contains 7_7.csv"):
        voxtile_dask.export(source, tmp_path / "files", ".csv", client=client)
    assert (beside / "7_7.csv").read_text() == "mine"
    # Remains of a killed call with other options.
    attempt = beside / ("0" * 32)
    attempt.mkdir()
    (beside / "7_7.csv").rename(attempt / "7_7.csv")
    report = voxtile_dask.export(source, tmp_path / "files", ".csv", client=client)
    assert "7_7.csv" not in report["files"]
    assert sorted(path.name for path in (tmp_path / "files").iterdir()) == report["files"]
    assert {path.name for path in tmp_path.iterdir()} == {"map", "files"}


def test_a_snapshot_is_named_as_in_the_command(client: object, tmp_path: Path) -> None:
    source = _map(tmp_path / "city@home", 5)
    with voxtile.Map.open(source) as opened:
        opened.snapshot("before")
    voxtile.export(source, tmp_path / "before.csv", region=[-1000, -1000, -1000, 1000, 1000, 1000])
    voxtile.clear(source, [-100, -100, -100, 100, 100, 0.5])
    voxtile.export(source, tmp_path / "now.csv", region=[-1000, -1000, -1000, 1000, 1000, 1000])
    for name, map in (("now", source), ("before", f"{source}@before")):
        voxtile_dask.export(map, tmp_path / name, ".csv", region_size=2000.0, client=client)
        lines = [line for path in (tmp_path / name).iterdir() for line in path.read_text().splitlines()]
        assert set(lines) == set((tmp_path / f"{name}.csv").read_text().splitlines())
    assert (tmp_path / "now.csv").read_bytes() != (tmp_path / "before.csv").read_bytes()


def test_threads_of_a_worker_open_separate_maps(tmp_path: Path) -> None:
    source = _map(tmp_path / "map", 5)
    with voxtile.Map.open(source, "r") as opened:
        tiles = [tuple(int(number) for number in tile) for tile in opened.tiles]
    order: list[tuple[int, ...]] = []
    is_opened, has_another_begun = threading.Event(), threading.Event()

    def look(tile: object) -> bool:
        if tile.index not in order:
            order.append(tile.index)
        if tile.index == order[0]:
            opened = tile._reader()
            is_opened.set()
            assert has_another_begun.wait(60)
            # The map stays at one flush for the whole task.
            return tile._reader() is opened
        assert is_opened.wait(60)
        # The second task may have begun before the first opened the map; the third did not.
        if tile.index == order[-1] != order[1]:
            has_another_begun.set()
        return True

    found = voxtile_dask.map_tiles(source, look, tiles=[tile for tile in tiles[:3] for _ in range(16)])
    assert found.npartitions == 3 and all(found.compute(scheduler="threads", num_workers=2))


@pytest.mark.parametrize(
    "options",
    [
        {"certainty": 0.55, "min_voxels": 1},
        {"tolerance": 0.0, "min_voxels": 1, "certainty": 0.6, "region": [-3, -9, -9, 3, 9, 9]},
    ],
)
def test_comparisons_by_many_workers_are_those_of_one(
    client: object, options: dict[str, object], tmp_path: Path
) -> None:
    # Blocks of 128 voxels, and more of them than of tiles.
    options = {"memory": "100MB", **options}
    before, after = (
        _map(tmp_path / name, seed, shift, resolution=0.05, keep_scans=True)
        for name, seed, shift in (("before", 3, 0.0), ("after", 4, 1.3))
    )
    whole = voxtile.compare(before, after, **options)
    assert whole.counts["vanished"]["voxels"] > 0 and whole.changes
    seen = []
    for parts in None, 1, 3, 400:
        found = voxtile_dask.compare(
            before, after, parts=parts, client=client, progress=lambda done, all: seen.append((done, all)), **options
        )
        assert found.to_dict() == whole.to_dict()
        for one, other in zip(found.voxels(), whole.voxels(), strict=True):
            assert (one == other).all()
    assert (400, 400) in seen
    with pytest.raises(errors.ArgumentError, match="parts"):
        voxtile_dask.compare(before, after, parts=0, client=client)
    with pytest.raises(errors.ArgumentError, match="distance"):
        voxtile_dask.compare(before, after, client=client, distance=1.0)
    with pytest.raises(errors.NoMapError):
        voxtile_dask.compare(before, tmp_path / "missing", client=client)
