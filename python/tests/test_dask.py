"""Distributed builds and updates with dask."""

from __future__ import annotations

import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from pathlib import Path

import numpy as np
import pytest
import voxtile
from conftest import scans_of
from voxtile import errors

distributed = pytest.importorskip("distributed")
voxtile_dask = pytest.importorskip("voxtile.dask")

OPTIONS = {"resolution": 0.25, "tile_size": 2.0, "max_range": 4.0}


@pytest.fixture
def whole(drive: Path, tmp_path: Path) -> str:
    voxtile.build(drive, tmp_path / "whole", **OPTIONS)
    return voxtile.digest(tmp_path / "whole")


@pytest.fixture(scope="module", params=[1, 3])
def client(request: pytest.FixtureRequest) -> Iterator[object]:
    cluster = distributed.LocalCluster(
        n_workers=request.param, threads_per_worker=1, processes=True, dashboard_address=None
    )
    with cluster, distributed.Client(cluster) as found:
        yield found


@pytest.mark.parametrize("region_size", [4.0, 5.3, 100.0])
def test_any_regions_make_the_map_of_one_build(
    client: object, region_size: float, drive: Path, whole: str, tmp_path: Path
) -> None:
    report = voxtile_dask.build(drive, tmp_path / "map", region_size=region_size, client=client, **OPTIONS)
    assert voxtile.digest(tmp_path / "map") == whole
    assert report["scans"] == 12 and (report["regions"] > 4) == (region_size < 100)
    assert not (tmp_path / "map.parts").exists()
    assert voxtile.verify(tmp_path / "map")["findings"] == []
    files = [file for file in (tmp_path / "map").rglob("*") if file.is_file()]
    assert len(files) > 20 and all(file.stat().st_nlink == 1 for file in files)


@pytest.mark.parametrize("region_size", [4.0, 5.3, 100.0])
def test_kept_scans_are_those_of_one_build(client: object, region_size: float, drive: Path, tmp_path: Path) -> None:
    # A scan that changes no voxel is kept, too.
    content = (drive / "004.pcd").read_bytes()
    at = content.index(b"binary\n") + len(b"binary\n")
    far = np.frombuffer(content[at:], np.float32) * np.float32(np.inf)
    (drive / "004.pcd").write_bytes(content[:at] + far.tobytes())
    voxtile.build(drive, tmp_path / "whole", keep_scans=True, **OPTIONS)
    options = {**OPTIONS, "keep_scans": True, "client": client, "region_size": region_size}
    voxtile_dask.build(drive, tmp_path / "map", **options)
    assert voxtile.verify(tmp_path / "map")["findings"] == []
    for digest in voxtile.digest, voxtile.scan_digest:
        assert digest(tmp_path / "map") == digest(tmp_path / "whole")
    poses = np.loadtxt(drive / "poses_kitti.txt")
    poses[5:, 3] += 0.4
    np.savetxt(tmp_path / "moved.txt", poses, fmt="%.17g")
    # One process changes the map, a cluster makes another one.
    voxtile_dask.build(tmp_path / "map", tmp_path / "moved", poses=tmp_path / "moved.txt", **options)
    rows = poses.reshape(-1, 3, 4)
    matrices = np.concatenate([rows, np.broadcast_to([[[0, 0, 0, 1.0]]], (len(rows), 1, 4))], axis=1)
    for path in "map", "whole":
        voxtile.remap(tmp_path / path, matrices)
    for digest in voxtile.digest, voxtile.scan_digest:
        assert digest(tmp_path / "map") == digest(tmp_path / "whole") == digest(tmp_path / "moved")


@pytest.mark.parametrize("region_size", [None, 4.0, 10.0])
def test_new_poses_by_many_workers(
    client: object, region_size: float | None, drive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    voxtile.build(drive, tmp_path / "map", keep_scans=True, **OPTIONS)
    shutil.copytree(tmp_path / "map", tmp_path / "one")
    rows = np.loadtxt(drive / "poses_kitti.txt").reshape(-1, 3, 4)
    poses = np.concatenate([rows, np.broadcast_to([[[0, 0, 0, 1.0]]], (len(rows), 1, 4))], axis=1)
    options = {"client": client, "region_size": region_size}
    for moved in {9: 0.7}, dict.fromkeys(range(5, 12), 0.3), {0: 3.0, 1: -0.5}:
        for number, by in moved.items():
            poses[number, 0, 3] += by
        # A failed commit leaves the finished parts.
        with monkeypatch.context() as failing:
            failing.setattr("voxtile.dask.replaying.join_replay", lambda *_, **__: (_ for _ in ()).throw(OSError("x")))
            with pytest.raises(OSError, match="x"):
                voxtile_dask.remap(tmp_path / "map", poses, **options)
        seen: list[tuple[int, int]] = []
        report = voxtile_dask.remap(tmp_path / "map", poses, **options, progress=lambda *done: seen.append(done))
        wanted = voxtile.remap(tmp_path / "one", poses)
        assert report["scans_changed"] == wanted["scans_changed"] == len(moved)
        assert report["parts_done_before"] == report["parts"] > 0 and not seen
        for digest in voxtile.digest, voxtile.scan_digest:
            assert digest(tmp_path / "map") == digest(tmp_path / "one")
    assert voxtile.verify(tmp_path / "map")["findings"] == []
    assert not (tmp_path / "map.replay.parts").exists()
    # Some poses; the others follow.
    some = {1: poses[0], 12: poses[11] @ np.diag([1.0, 1.0, 1.0, 1.0])}
    some[12][1, 3] += 1.0
    voxtile_dask.remap(tmp_path / "map", some, interpolate=True, keep_as="before", **options)
    voxtile.remap(tmp_path / "one", some, interpolate=True)
    assert voxtile.scan_digest(tmp_path / "map") == voxtile.scan_digest(tmp_path / "one")
    assert voxtile.digest(tmp_path / "map") == voxtile.digest(tmp_path / "one")
    assert voxtile.digest(tmp_path / "map", snapshot="before") != voxtile.digest(tmp_path / "map")


def test_the_tile_size_follows_the_resolution(client: object, drive: Path, tmp_path: Path) -> None:
    options = {"resolution": 0.15, "max_range": 4.0}
    voxtile.build(drive, tmp_path / "whole", **options)
    voxtile_dask.build(drive, tmp_path / "map", region_size=25.0, client=client, **options)
    assert voxtile.digest(tmp_path / "map") == voxtile.digest(tmp_path / "whole")
    assert voxtile.open(tmp_path / "map").tile_size == 10.05


def test_killed_workers_do_not_change_the_map(drive: Path, whole: str, tmp_path: Path) -> None:
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
    killed = []
    parts = tmp_path / "map.parts"

    def kill(client: object) -> None:
        # Once the first part exists, others are being built.
        while not any(parts.glob("*-*-*")):
            time.sleep(0.001)
        for worker in list(cluster.workers.values())[:1]:
            os.kill(worker.process.pid, 9)
            killed.append(worker)

    with cluster, distributed.Client(cluster) as client:
        killer = threading.Thread(target=kill, args=[client], daemon=True)
        killer.start()
        voxtile_dask.build(drive, tmp_path / "map", region_size=4.0, client=client, **OPTIONS)
        killer.join(10)
    assert killed and voxtile.digest(tmp_path / "map") == whole


def _occupied(tile: object) -> tuple[int, float]:
    centers, probabilities = tile.occupied()
    dense, corner = tile.dense("log_odds")
    region = tile.region
    assert dense.shape == (8, 8, 8) and np.allclose(corner, region[:3])
    assert np.all(centers > region[:3]) and np.all(centers < region[3:])
    return len(centers), float(np.nansum(dense))


def test_a_function_of_the_tiles_sees_every_voxel_once(client: object, drive: Path, tmp_path: Path) -> None:
    voxtile.build(drive, tmp_path / "map", **OPTIONS)
    with voxtile.Map.open(tmp_path / "map", "r") as opened:
        occupied = len(opened.occupied()[0])
        tiles = opened.tiles
        dense, _ = opened.to_dense(opened.bounds.reshape(-1), "log_odds")
    found = voxtile_dask.map_tiles(tmp_path / "map", _occupied).compute()
    assert len(found) == len(tiles) > 20
    assert sum(count for count, _ in found) == occupied > 0
    assert np.isclose(sum(total for _, total in found), np.nansum(dense))
    # Results have the given order, also for a snapshot.
    some = [tuple(int(number) for number in tile) for tile in tiles[:3]]
    back = voxtile_dask.map_tiles(tmp_path / "map", _occupied, tiles=some[::-1]).compute()
    assert back == found[:3][::-1]
    with voxtile.Map.open(tmp_path / "map") as opened:
        opened.snapshot("before")
    voxtile.clear(tmp_path / "map", [-100, -100, -100, 100, 100, 100])
    assert voxtile_dask.map_tiles(tmp_path / "map", _occupied).compute() == []
    assert voxtile_dask.map_tiles(tmp_path / "map", _occupied, snapshot="before").compute() == found


def test_an_error_names_the_failed_worker(
    drive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Files of a worker are limited to a kilobyte, as on a full disk.
    def fill(dask_worker: object) -> None:
        import resource
        import signal

        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1024, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))

    cluster = distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None, local_directory=tmp_path / "local"
    )
    with cluster, distributed.Client(cluster) as client:
        client.run(fill)
        with pytest.raises(errors.VoxtileError, match=r"worker tcp://127\.0\.0\.1:\d+, whose disk is .*local"):
            voxtile_dask.build(drive, tmp_path / "map", client=client, **OPTIONS)


def test_a_build_resumes_after_repeated_kills_of_workers(
    drive: Path, whole: str, tmp_path: Path
) -> None:
    # VOXTILE_DASK_KILLS=20 takes a minute.
    kills = int(os.environ.get("VOXTILE_DASK_KILLS", "4"))
    random, killed = np.random.default_rng(5), 0
    cluster = distributed.LocalCluster(n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None)
    is_over = threading.Event()

    def kill() -> None:
        nonlocal killed
        while killed < kills and not is_over.wait(random.uniform(0.02, 0.4)):
            workers = [nanny.process for nanny in cluster.workers.values()]
            pids = [worker.pid for worker in workers if worker is not None and worker.pid is not None]
            if pids:
                os.kill(random.choice(pids), 9)
                killed += 1

    failures = 0
    with cluster, distributed.Client(cluster) as client:
        killer = threading.Thread(target=kill, daemon=True)
        killer.start()
        while True:
            try:
                voxtile_dask.build(drive, tmp_path / "map", region_size=4.0, client=client, **OPTIONS)
            except errors.VoxtileError as error:
                failures += 1
                assert "call again to resume" in str(error) and failures <= kills
                continue
            if killed >= kills:
                break
            # The build finished before the kills.
            assert voxtile.digest(tmp_path / "map") == whole
            shutil.rmtree(tmp_path / "map")
        is_over.set()
        killer.join(10)
    assert killed == kills and voxtile.digest(tmp_path / "map") == whole


def test_a_build_resumes_after_a_kill_of_the_scheduler(
    drive: Path, whole: str, tmp_path: Path
) -> None:
    start = "import sys; from dask.__main__ import main; sys.exit(main())"
    address = tmp_path / "scheduler.json"
    dask = [sys.executable, "-c", start]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    common = [f"--scheduler-file={address}", "--no-dashboard"]
    scheduler = subprocess.Popen([*dask, "scheduler", "--port=0", *common], **quiet)
    worker = subprocess.Popen(
        [*dask, "worker", "--nthreads=1", f"--local-directory={tmp_path}", *common], **quiet
    )
    try:
        client = distributed.Client(scheduler_file=str(address), timeout="60s")

        def kill(done: int, regions: int) -> None:
            if done == 2:
                scheduler.kill()

        with pytest.raises(errors.VoxtileError, match="call again to resume"):
            voxtile_dask.build(
                drive, tmp_path / "map", region_size=4.0, client=client, progress=kill, **OPTIONS
            )
        client.close(timeout=1)
    finally:
        worker.kill()
        scheduler.kill()
        worker.wait()
        scheduler.wait()
    with distributed.Client(n_workers=1, threads_per_worker=1, dashboard_address=None) as client:
        report = voxtile_dask.build(drive, tmp_path / "map", region_size=4.0, client=client, **OPTIONS)
    assert report["regions_done_before"] >= 2 and voxtile.digest(tmp_path / "map") == whole


@pytest.mark.parametrize("error", [CancelledError("lost"), distributed.comm.CommClosedError("closed")])
def test_a_scheduler_lost_during_a_call_is_an_error_with_a_remedy(
    error: BaseException, drive: Path, whole: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    city, other = tmp_path / "whole", tmp_path / "other"

    def fail(*_: object, **__: object) -> None:
        raise error

    with distributed.Client(n_workers=1, threads_per_worker=1, dashboard_address=None) as client:
        of_future, of_client = (distributed.Future, "result"), (distributed.Client, "gather")
        calls: list[tuple[tuple[type, str], Callable[[], object]]] = [
            (of_client, lambda: voxtile_dask.build(drive, other, region_size=4.0, client=client, **OPTIONS)),
            (of_future, lambda: voxtile_dask.build(drive, other, region_size=4.0, client=client, **OPTIONS)),
            (of_client, lambda: voxtile_dask.decay(city, tmp_path / "faded", 10.0, client=client)),
            (of_future, lambda: voxtile_dask.merge([city], tmp_path / "merged", client=client)),
            (of_client, lambda: voxtile_dask.verify(city, client=client)),
            (of_client, lambda: voxtile_dask.export(city, tmp_path / "files", ".csv", client=client)),
            (of_future, lambda: voxtile_dask.statistics(city, client=client)),
        ]
        for method, call in calls:
            with monkeypatch.context() as broken:
                broken.setattr(*method, fail)
                with pytest.raises(errors.VoxtileError, match="call again.*a running scheduler"):
                    call()
        # No failed call blocks the next one.
        for _, call in calls[1:]:
            call()
    assert voxtile.digest(other) == voxtile.digest(tmp_path / "merged") == whole


def test_merge_keeps_foreign_folders_and_removes_remains_of_killed_calls(
    client: object, drive: Path, whole: str, tmp_path: Path
) -> None:
    beside = tmp_path / "merged.columns"
    beside.mkdir()
    (beside / "thesis.txt").write_text("mine")
    with pytest.raises(errors.ArgumentError, match="contains thesis.txt"):
        voxtile_dask.merge([tmp_path / "whole"], tmp_path / "merged", client=client)
    assert (beside / "thesis.txt").read_text() == "mine"
    (beside / "thesis.txt").unlink()
    (beside / ("0" * 32)).mkdir()
    voxtile_dask.merge([tmp_path / "whole"], tmp_path / "merged", client=client)
    assert voxtile.digest(tmp_path / "merged") == whole and not list(tmp_path.glob("merged.*"))


def test_a_build_keeps_a_foreign_folder_of_parts(client: object, drive: Path, tmp_path: Path) -> None:
    parts = tmp_path / "map.parts"
    parts.mkdir()
    (parts / "thesis.txt").write_text("mine")
    with pytest.raises(errors.ArgumentError, match="contains thesis.txt"):
        voxtile_dask.build(drive, tmp_path / "map", region_size=4.0, client=client, **OPTIONS)
    assert [path.name for path in parts.iterdir()] == ["thesis.txt"] and not (tmp_path / "map").exists()


def test_parts_of_an_abandoned_call_are_not_used(
    client: object, drive: Path, whole: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise errors.DiskError("the disk is full")

    with monkeypatch.context() as broken:
        broken.setattr("voxtile.dask.building.join", fail)
        with pytest.raises(errors.DiskError, match="full"):
            voxtile_dask.build(drive, tmp_path / "map", region_size=4.0, client=client, **OPTIONS)
    # As if the folder had been removed and a task that was still running had written a part.
    (tmp_path / "map.parts" / "map_id.json").unlink()
    for part in list((tmp_path / "map.parts").glob("*-*-*"))[1:]:
        shutil.rmtree(part)
    report = voxtile_dask.build(drive, tmp_path / "map", region_size=4.0, client=client, **OPTIONS)
    assert report["regions_done_before"] == 0 and voxtile.digest(tmp_path / "map") == whole


def test_a_point_beyond_max_range_adds_no_regions(client: object, drive: Path, tmp_path: Path) -> None:
    scan = drive / "003.pcd"
    content = bytearray(scan.read_bytes())
    struct.pack_into("<2f", content, content.index(b"DATA binary\n") + len(b"DATA binary\n"), 1e7, 1e7)
    scan.write_bytes(content)
    without_range = {name: value for name, value in OPTIONS.items() if name != "max_range"}
    report = voxtile_dask.build(drive, tmp_path / "map", region_size=40.0, client=client, **without_range)
    voxtile.build(drive, tmp_path / "whole", **without_range)
    assert voxtile.digest(tmp_path / "map") == voxtile.digest(tmp_path / "whole") and report["regions"] < 20
    with pytest.raises(errors.ArgumentError, match="^scan 3: .*smaller max_range"):
        voxtile_dask.build(drive, tmp_path / "other", client=client, **{**OPTIONS, "max_range": 1e6})
    assert {path.name for path in tmp_path.iterdir()} == {"drive", "map", "whole"}


def test_maps_without_tiles_decay_and_merge(client: object, tmp_path: Path) -> None:
    empty = tmp_path / "empty"
    voxtile.Map.create(empty, resolution=0.2).close()
    voxtile_dask.decay(empty, tmp_path / "faded", 10.0, client=client)
    voxtile_dask.merge([empty, empty], tmp_path / "merged", client=client)
    for made in ["faded", "merged"]:
        assert voxtile.digest(tmp_path / made) == voxtile.digest(empty)
        assert voxtile.open(tmp_path / made).resolution == 0.2


def test_a_worker_on_another_file_system_copies_its_parts(
    drive: Path, whole: str, tmp_path: Path
) -> None:
    memory = Path("/dev/shm")
    if not memory.is_dir() or memory.stat().st_dev == tmp_path.stat().st_dev:
        pytest.skip("there is no second file system")
    with tempfile.TemporaryDirectory(dir=memory) as local:
        cluster = distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None, local_directory=local
        )
        with cluster, distributed.Client(cluster) as client:
            voxtile_dask.build(drive, tmp_path / "map", region_size=4.0, client=client, **OPTIONS)
    assert voxtile.digest(tmp_path / "map") == whole
    assert voxtile.verify(tmp_path / "map")["findings"] == []


def test_unsupported_options_are_errors(client: object, drive: Path, tmp_path: Path) -> None:
    for name, value in {"region_size": 1.0, "every": 2}.items():
        with pytest.raises(errors.ArgumentError, match=f"^{name}: "):
            voxtile_dask.build(drive, tmp_path / "map", client=client, **{**OPTIONS, name: value})
    (tmp_path / "map").mkdir()
    with pytest.raises(errors.ArgumentError, match="already exists"):
        voxtile_dask.build(drive, tmp_path / "map", client=client, **OPTIONS)


def test_the_command_builds_a_map_and_reports(drive: Path, whole: str, tmp_path: Path) -> None:
    options = [f"--{name.replace('_', '-')}={value}" for name, value in OPTIONS.items()]
    command = [sys.executable, "-m", "voxtile.dask", str(drive), "-o", str(tmp_path / "map"), "--local=2", *options]
    done = subprocess.run([*command, "--region-size=5", "--json"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert voxtile.digest(tmp_path / "map") == whole
    assert report["regions"] > 1 and report["overlap"] >= 1 and report["slowest"][0]["seconds"] > 0
    again = subprocess.run(command, capture_output=True, text=True, check=False)
    assert again.returncode == 2 and "already exists" in again.stderr


def test_a_second_run_resumes(
    client: object, drive: Path, whole: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise errors.DiskError("the disk is full")

    with monkeypatch.context() as broken:
        broken.setattr("voxtile.dask.building.join", fail)
        with pytest.raises(errors.DiskError, match="full"):
            voxtile_dask.build(drive, tmp_path / "map", region_size=4.0, client=client, **OPTIONS)
    report = voxtile_dask.build(drive, tmp_path / "map", region_size=4.0, client=client, **OPTIONS)
    assert report["regions_done_before"] == report["regions"] > 1 and not report["slowest"]
    assert voxtile.digest(tmp_path / "map") == whole


def test_a_damaged_part_is_an_error(
    client: object, drive: Path, whole: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise errors.DiskError("the disk is full")

    def build() -> dict[str, object]:
        return voxtile_dask.build(drive, tmp_path / "map", region_size=4.0, client=client, **OPTIONS)

    with monkeypatch.context() as broken:
        broken.setattr("voxtile.dask.building.join", fail)
        with pytest.raises(errors.DiskError, match="full"):
            build()
    tile = next((tmp_path / "map.parts").glob("*-*-*/tile_*/iwlo_meta.bin"))
    content = bytearray(tile.read_bytes())
    content[20] ^= 1
    tile.write_bytes(content)
    with pytest.raises(errors.VoxtileError, match=f"{tile}.*remove {tile.parent.parent}"):
        build()
    assert not (tmp_path / "map").exists()
    shutil.rmtree(tile.parent.parent)
    report = build()
    assert report["regions_done_before"] == report["regions"] - 1
    assert voxtile.digest(tmp_path / "map") == whole


def test_a_stream_of_scans_in_a_file_makes_the_same_map(client: object, tmp_path: Path) -> None:
    stream = bytearray(b"VXSCANS\n" + struct.pack("<III", 1, 0, 0))
    for number, (points, pose) in enumerate(scans_of(11, count=12)):
        position = [0.7 * number - 3.1, *pose[1:3]]
        stream += struct.pack("<I7d", len(points), *position, 0.0, 0.0, 0.0, 1.0)
        stream += np.ascontiguousarray(points[:, :3], dtype="<f4").tobytes()
    (tmp_path / "drive.scans").write_bytes(stream)
    voxtile.build(tmp_path / "drive.scans", tmp_path / "whole", **OPTIONS)
    report = voxtile_dask.build(tmp_path / "drive.scans", tmp_path / "map", region_size=4.0, client=client, **OPTIONS)
    assert report["scans"] == 12 and report["regions"] > 1
    assert voxtile.digest(tmp_path / "map") == voxtile.digest(tmp_path / "whole")


def test_a_second_run_ignores_parts_of_other_scans(
    drive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise errors.DiskError("the disk is full")

    cluster = distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None)
    with cluster, distributed.Client(cluster) as client:
        with monkeypatch.context() as broken:
            broken.setattr("voxtile.dask.building.join", fail)
            with pytest.raises(errors.DiskError, match="full"):
                voxtile_dask.build(drive, tmp_path / "map", region_size=4.0, client=client, **OPTIONS)
        # The first point is mirrored along z: the box around the scan is the same.
        scan = drive / "003.pcd"
        content = bytearray(scan.read_bytes())
        content[content.index(b"DATA binary\n") + len(b"DATA binary\n") + 11] ^= 0x80
        scan.write_bytes(content)
        report = voxtile_dask.build(drive, tmp_path / "map", region_size=4.0, client=client, **OPTIONS)
    voxtile.build(drive, tmp_path / "whole", **OPTIONS)
    assert report["regions_done_before"] == 0
    assert voxtile.digest(tmp_path / "map") == voxtile.digest(tmp_path / "whole")


def _again(drive: Path, tmp_path: Path) -> Path:
    """The same street, driven back on a parallel line and slightly beyond its end."""
    folder = tmp_path / "again"
    folder.mkdir()
    poses = np.loadtxt(drive / "poses_kitti.txt")[::-1]
    poses[:, 3] += 3.0
    poses[:, 7] += 1.3
    for number, scan in enumerate(sorted(drive.glob("*.pcd"))):
        shutil.copy(scan, folder / f"{number:03}.pcd")
    np.savetxt(folder / "poses_kitti.txt", poses, fmt="%.17g")
    return folder


@pytest.mark.parametrize("keeps", [False, True])
@pytest.mark.parametrize("region_size", [4.0, 5.3, 100.0])
def test_new_drives_into_a_map_make_the_map_of_one_build(
    client: object, region_size: float, keeps: bool, drive: Path, tmp_path: Path
) -> None:
    again, city = _again(drive, tmp_path), tmp_path / "city"
    # A scan that reaches no region.
    content = (again / "004.pcd").read_bytes()
    at = content.index(b"binary\n") + len(b"binary\n")
    far = np.frombuffer(content[at:], np.float32) * np.float32(np.inf)
    (again / "004.pcd").write_bytes(content[:at] + far.tobytes())
    voxtile.build(drive, tmp_path / "whole", keep_scans=keeps, **OPTIONS)
    shutil.copytree(tmp_path / "whole", city)
    before = voxtile.digest(city)
    with voxtile.open(city) as reader:
        voxtile.build(again, tmp_path / "whole", append=True, again=True, **OPTIONS)
        report = voxtile_dask.build(
            again, city, update=True, region_size=region_size, client=client, **OPTIONS
        )
        # A reader opened before the update still sees the old map.
        assert reader.digest() == before
        assert reader.refresh() and reader.digest() != before
        scans = reader.scan_number
    assert voxtile.digest(city) == voxtile.digest(tmp_path / "whole")
    assert scans == 24 and report["adopted"]["scan_number"] == 24
    assert report["adopted"]["tiles_added"] > 0 and report["adopted"]["tiles_changed"] > 0
    assert voxtile.verify(city)["damage"] == 0
    # The command can append to the updated map, too.
    for map in (city, tmp_path / "whole"):
        voxtile.build(drive, map, append=True, again=True, **OPTIONS)
    assert voxtile.digest(city) == voxtile.digest(tmp_path / "whole")
    if keeps:
        assert voxtile.scan_digest(city) == voxtile.scan_digest(tmp_path / "whole")
        # The scans can be replayed.
        for map in (city, tmp_path / "whole"):
            voxtile.remove_points(map, [[-2, -9, -9], [1, 9, 9]])
            report = voxtile.remove_scans(map, input="again")
            assert report["scans_removed"] == 12
        assert voxtile.digest(city) == voxtile.digest(tmp_path / "whole")
        assert voxtile.scan_digest(city) == voxtile.scan_digest(tmp_path / "whole")
        assert voxtile.verify(city)["findings"] == []


def test_an_update_with_killed_workers_is_atomic(drive: Path, tmp_path: Path) -> None:
    again, city = _again(drive, tmp_path), tmp_path / "city"
    voxtile.build(drive, city, **OPTIONS)
    before = voxtile.digest(city)
    shutil.copytree(city, tmp_path / "whole")
    voxtile.build(again, tmp_path / "whole", append=True, again=True, **OPTIONS)
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
    parts, seen, killed = tmp_path / "city.parts", [], []
    is_over = threading.Event()

    def kill() -> None:
        while not is_over.is_set() and len(killed) < 2:
            if len(list(parts.glob("*-*-*"))) > len(killed):
                seen.append(voxtile.digest(city))
                pid = list(cluster.workers.values())[len(killed)].process.pid
                if pid is not None:
                    os.kill(pid, 9)
                    killed.append(pid)
            time.sleep(0.001)

    with cluster, distributed.Client(cluster) as client:
        killer = threading.Thread(target=kill, daemon=True)
        killer.start()
        voxtile_dask.build(again, city, update=True, region_size=4.0, client=client, **OPTIONS)
        is_over.set()
        killer.join(10)
    after = voxtile.digest(tmp_path / "whole")
    assert killed and set(seen) <= {before, after} and voxtile.digest(city) == after != before


@pytest.mark.parametrize("killed_in", ["replace_tiles", "remove"])
@pytest.mark.parametrize("is_changed", [False, True])
@pytest.mark.parametrize("keeps", [False, True])
def test_an_update_killed_at_its_end_is_applied_once(
    client: object,
    killed_in: str,
    is_changed: bool,
    keeps: bool,
    drive: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    again, city, whole = _again(drive, tmp_path), tmp_path / "city", tmp_path / "whole"
    voxtile.build(drive, city, keep_scans=keeps, **OPTIONS)
    shutil.copytree(city, whole)

    def fail(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as broken:
        broken.setattr(f"voxtile.dask.building.{killed_in}", fail)
        with pytest.raises(KeyboardInterrupt):
            voxtile_dask.build(again, city, update=True, region_size=5.0, client=client, **OPTIONS)
    # Another writer adds as many scans as the update.
    others = [drive] if is_changed else []
    for scans in others:
        voxtile.build(scans, city, append=True, again=True, **OPTIONS)
    report = voxtile_dask.build(again, city, update=True, region_size=5.0, client=client, **OPTIONS)
    is_done_before = killed_in == "remove" or not is_changed
    assert report["regions_done_before"] == (report["regions"] if is_done_before else 0)
    for scans in [again, *others] if killed_in == "remove" else [*others, again]:
        voxtile.build(scans, whole, append=True, again=True, **OPTIONS)
    assert voxtile.digest(city) == voxtile.digest(whole)
    assert not (tmp_path / "city.parts").exists()


def test_an_update_with_unknown_outcome_is_an_error(
    client: object, drive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    again, city, parts = _again(drive, tmp_path), tmp_path / "city", tmp_path / "city.parts"
    voxtile.build(drive, city, **OPTIONS)

    def fail(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as broken:
        broken.setattr("voxtile.dask.building.remove", fail)
        with pytest.raises(KeyboardInterrupt):
            voxtile_dask.build(again, city, update=True, region_size=5.0, client=client, **OPTIONS)
    # As with a map whose list of scans had an unknown length.
    note = json.loads((parts / "adopting.json").read_text())
    note["map"]["unlisted_scans"] = None
    (parts / "adopting.json").write_text(json.dumps(note))
    with pytest.raises(errors.ArgumentError, match=f"committed 12 scans after scan 12.*remove {parts}"):
        voxtile_dask.build(again, city, update=True, region_size=5.0, client=client, **OPTIONS)


def test_an_update_of_a_concurrently_changed_map_is_an_error(client: object, drive: Path, tmp_path: Path) -> None:
    again, city = _again(drive, tmp_path), tmp_path / "city"
    voxtile.build(drive, city, **OPTIONS)
    changed = []

    def change(done: int, regions: int) -> None:
        if not changed:
            voxtile.clear(city, [-1, -1, -1, 1, 1, 1])
            changed.append(voxtile.digest(city))

    with pytest.raises(errors.ArgumentError, match="the map has changed meanwhile"):
        voxtile_dask.build(
            again, city, update=True, region_size=5.0, client=client, progress=change, **OPTIONS
        )
    assert voxtile.digest(city) == changed[0]
    # The next call adds the scans to the changed map.
    shutil.copytree(city, tmp_path / "whole")
    voxtile.build(again, tmp_path / "whole", append=True, again=True, **OPTIONS)
    voxtile_dask.build(again, city, update=True, region_size=5.0, client=client, **OPTIONS)
    assert voxtile.digest(city) == voxtile.digest(tmp_path / "whole") != changed[0]
    with pytest.raises(errors.VoxtileError, match="no map here"):
        voxtile_dask.build(again, tmp_path / "none", update=True, client=client)
    with pytest.raises(errors.ArgumentError, match="^resolution: "):
        voxtile_dask.build(again, city, update=True, client=client, resolution=0.5)
    with pytest.raises(errors.ArgumentError, match="^keep_scans: an update cannot begin to"):
        voxtile_dask.build(again, city, update=True, client=client, keep_scans=True)


def test_an_update_whose_parts_lack_a_scan_is_an_error(
    client: object, drive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    again, city = _again(drive, tmp_path), tmp_path / "city"
    voxtile.build(drive, city, keep_scans=True, **OPTIONS)
    before = voxtile.digest(city), voxtile.scan_digest(city)
    replace_tiles = voxtile.dask.building.replace_tiles
    with monkeypatch.context() as broken:
        broken.setattr(
            "voxtile.dask.building.replace_tiles", lambda map, parts, **how: replace_tiles(map, parts[:1], **how)
        )
        with pytest.raises(errors.ArgumentError, match="no part keeps scan"):
            voxtile_dask.build(again, city, update=True, region_size=4.0, client=client, **OPTIONS)
    assert (voxtile.digest(city), voxtile.scan_digest(city)) == before
    assert voxtile.verify(city)["findings"] == []
    # The same call continues, with all parts.
    report = voxtile_dask.build(again, city, update=True, region_size=4.0, client=client, **OPTIONS)
    assert report["regions_done_before"] == report["regions"]
    voxtile.build(drive, tmp_path / "whole", keep_scans=True, **OPTIONS)
    voxtile.build(again, tmp_path / "whole", append=True, again=True, **OPTIONS)
    for digest in voxtile.digest, voxtile.scan_digest:
        assert digest(city) == digest(tmp_path / "whole")


def test_each_visit_of_a_region_is_read(client: object, drive: Path, tmp_path: Path) -> None:
    """Thirty scans elsewhere between two visits of the street."""
    folder, scans = tmp_path / "round", sorted(drive.glob("*.pcd"))
    folder.mkdir()
    poses = np.loadtxt(drive / "poses_kitti.txt")
    elsewhere = np.repeat(poses[:1], 30, axis=0)
    elsewhere[:, 3] += 60.0 + 0.1 * np.arange(30)
    poses = np.concatenate([poses, elsewhere, poses[::-1]])
    for number in range(len(poses)):
        shutil.copy(scans[number % len(scans)], folder / f"{number:03}.pcd")
    np.savetxt(folder / "poses_kitti.txt", poses, fmt="%.17g")
    voxtile.build(folder, tmp_path / "whole", **OPTIONS)
    report = voxtile_dask.build(folder, tmp_path / "map", region_size=20.0, client=client, **OPTIONS)
    assert voxtile.digest(tmp_path / "map") == voxtile.digest(tmp_path / "whole")
    assert max(task["ranges"] for task in report["slowest"]) == 2


@pytest.mark.parametrize("suffix", [".ply", ".xyz", ".las"])
def test_files_of_regions_are_those_of_the_command(client: object, suffix: str, drive: Path, tmp_path: Path) -> None:
    voxtile.build(drive, tmp_path / "map", **OPTIONS)
    report = voxtile_dask.export(tmp_path / "map", tmp_path / "files", suffix, region_size=5.0, client=client)
    assert sorted(path.name for path in (tmp_path / "files").iterdir()) == report["files"] and len(report["files"]) > 4
    for name in report["files"]:
        x, y = map(int, name.removesuffix(suffix).split("_"))
        region = [5.0 * x, 5.0 * y, -100.0, 5.0 * (x + 1), 5.0 * (y + 1), 100.0]
        voxtile.export(tmp_path / "map", tmp_path / f"one{suffix}", region=region)
        assert (tmp_path / "files" / name).read_bytes() == (tmp_path / f"one{suffix}").read_bytes(), name
    if suffix == ".xyz":
        voxtile.export(tmp_path / "map", tmp_path / "whole.xyz")
        whole = (tmp_path / "whole.xyz").read_text().splitlines()
        parts = [line for name in report["files"] for line in (tmp_path / "files" / name).read_text().splitlines()]
        assert sorted(set(whole)) == sorted(set(parts)) and len(whole) > 100
    with pytest.raises(errors.ArgumentError, match="already exists"):
        voxtile_dask.export(tmp_path / "map", tmp_path / "files", suffix, client=client)


def test_statistics_are_those_of_the_whole_map(client: object, drive: Path, tmp_path: Path) -> None:
    voxtile.build(drive, tmp_path / "map", **OPTIONS)
    report = voxtile_dask.statistics(tmp_path / "map", client=client)
    info = json.loads(
        subprocess.check_output([sys.executable, "-m", "voxtile", "info", "--json", str(tmp_path / "map")])
    )
    assert report["tiles"] == info["tiles"] and report["occupied"] > 0
    assert [report["observed"], report["occupied"]] == [info["voxels"], info["occupied"]]
    with voxtile.open(tmp_path / "map") as opened:
        centers = opened.occupied()[0]
    assert report["occupied_low"] == centers.min(axis=0).tolist()
    assert report["occupied_high"] == centers.max(axis=0).tolist()


@pytest.mark.parametrize("region_size", [40.0, 70.0])
@pytest.mark.parametrize("name", ["mulran_riverside02_a", "balm_os0_hall", "fastlio_hku_1"])
def test_recorded_scans(client: object, name: str, region_size: float, tmp_path: Path) -> None:
    data = Path(os.environ.get("VOXTILE_DATA", "")) / name
    if "VOXTILE_DATA" not in os.environ or not data.is_dir():
        pytest.skip(f"{name} is missing; set VOXTILE_DATA to the folder of recorded sets")
    options = {"resolution": 0.5, "max_range": 40.0, "storage": "compact"}
    voxtile.build(data, tmp_path / "whole", **options)
    voxtile_dask.build(data, tmp_path / "map", region_size=region_size, client=client, **options)
    assert voxtile.digest(tmp_path / "map") == voxtile.digest(tmp_path / "whole")
