"""Maps that several processes make, part by part."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import voxtile
from conftest import matrix_of, scans_of
from voxtile import errors

distributed = pytest.importorskip("distributed")
voxtile_dask = pytest.importorskip("voxtile.dask")

OPTIONS = {"resolution": 0.25, "tile_size": 2.0, "max_range": 4.0}


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """Scans along a street, each of them seven metres on."""
    folder = tmp_path / "drive"
    folder.mkdir()
    header = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
    poses = []
    for number, (points, pose) in enumerate(scans_of(11, count=12)):
        pose[0] = 0.7 * number - 3.1
        sizes = f"WIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(points)}\nDATA binary\n"
        (folder / f"{number:03}.pcd").write_bytes((header + sizes).encode() + points.tobytes())
        poses.append(matrix_of(pose)[:3].reshape(-1))
    np.savetxt(folder / "poses_kitti.txt", poses, fmt="%.17g")
    return folder


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


def test_workers_that_are_killed_change_nothing(drive: Path, whole: str, tmp_path: Path) -> None:
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
    killed = []
    parts = tmp_path / "map.parts"

    def kill(client: object) -> None:
        # When the first part is there, others are being made.
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


def test_what_a_build_in_parts_does_not_take_is_named(client: object, drive: Path, tmp_path: Path) -> None:
    for name, value in {"region_size": 1.0, "every": 2, "keep_scans": True}.items():
        with pytest.raises(errors.ArgumentError, match=f"^{name}: "):
            voxtile_dask.build(drive, tmp_path / "map", client=client, **{**OPTIONS, name: value})
    (tmp_path / "map").mkdir()
    with pytest.raises(errors.ArgumentError, match="it exists"):
        voxtile_dask.build(drive, tmp_path / "map", client=client, **OPTIONS)


def test_the_command_makes_the_map_and_tells_of_it(drive: Path, whole: str, tmp_path: Path) -> None:
    options = [f"--{name.replace('_', '-')}={value}" for name, value in OPTIONS.items()]
    command = [sys.executable, "-m", "voxtile.dask", str(drive), "-o", str(tmp_path / "map"), "--local=2", *options]
    done = subprocess.run([*command, "--region-size=5", "--json"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert voxtile.digest(tmp_path / "map") == whole
    assert told["regions"] > 1 and told["overlap"] >= 1 and told["slowest"][0]["seconds"] > 0
    again = subprocess.run(command, capture_output=True, text=True, check=False)
    assert again.returncode == 2 and "it exists" in again.stderr


def test_a_second_run_goes_on(
    client: object, drive: Path, whole: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise errors.DiskError("the disk is full")

    with monkeypatch.context() as broken:
        broken.setattr("voxtile.dask.building.merge", fail)
        with pytest.raises(errors.DiskError, match="full"):
            voxtile_dask.build(drive, tmp_path / "map", region_size=4.0, client=client, **OPTIONS)
    report = voxtile_dask.build(drive, tmp_path / "map", region_size=4.0, client=client, **OPTIONS)
    assert report["regions_done_before"] == report["regions"] > 1 and not report["slowest"]
    assert voxtile.digest(tmp_path / "map") == whole


def test_a_second_run_takes_no_parts_of_other_points(
    drive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise errors.DiskError("the disk is full")

    cluster = distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None)
    with cluster, distributed.Client(cluster) as client:
        with monkeypatch.context() as broken:
            broken.setattr("voxtile.dask.building.merge", fail)
            with pytest.raises(errors.DiskError, match="full"):
                voxtile_dask.build(drive, tmp_path / "map", region_size=4.0, client=client, **OPTIONS)
        # The first point changes sides along z: the box around the scan is the same.
        scan = drive / "003.pcd"
        content = bytearray(scan.read_bytes())
        content[content.index(b"DATA binary\n") + len(b"DATA binary\n") + 11] ^= 0x80
        scan.write_bytes(content)
        report = voxtile_dask.build(drive, tmp_path / "map", region_size=4.0, client=client, **OPTIONS)
    voxtile.build(drive, tmp_path / "whole", **OPTIONS)
    assert report["regions_done_before"] == 0
    assert voxtile.digest(tmp_path / "map") == voxtile.digest(tmp_path / "whole")


@pytest.mark.parametrize("name", ["mulran_riverside02_a", "balm_os0_hall"])
def test_recorded_scans(client: object, name: str, tmp_path: Path) -> None:
    data = Path(os.environ.get("VOXTILE_DATA", "")) / name
    if "VOXTILE_DATA" not in os.environ or not data.is_dir():
        pytest.skip(f"{name} is not there; VOXTILE_DATA names the folder of recorded sets")
    options = {"resolution": 0.5, "max_range": 40.0, "storage": "compact"}
    voxtile.build(data, tmp_path / "whole", **options)
    voxtile_dask.build(data, tmp_path / "map", region_size=70.0, client=client, **options)
    assert voxtile.digest(tmp_path / "map") == voxtile.digest(tmp_path / "whole")
