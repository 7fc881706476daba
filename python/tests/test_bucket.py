"""Maps in a bucket, against the S3 server of moto."""

import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import voxtile
from conftest import Scan
from voxtile import errors

boto3 = pytest.importorskip("boto3")
moto = pytest.importorskip("moto.server")


@pytest.fixture
def bucket(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    server = moto.ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    for name, value in {
        "AWS_ACCESS_KEY_ID": "key",
        "AWS_SECRET_ACCESS_KEY": "secret",
        "AWS_REGION": "us-east-1",
        "AWS_ENDPOINT_URL": f"http://{host}:{port}",
    }.items():
        monkeypatch.setenv(name, value)
    boto3.client("s3", region_name="us-east-1").create_bucket(Bucket="robots")
    yield "s3://robots"
    server.stop()


def test_maps_and_kept_scans_are_read_from_a_bucket(tmp_path: Path, room: list[Scan], bucket: str) -> None:
    city = tmp_path / "city"
    with voxtile.Map.create(city, 0.25, tile_size=4.0, keep_scans=True) as built:
        built.insert_many(room[:2])
        built.snapshot("early")
        built.insert_many(room[2:])
    url = f"{bucket}/city"
    push = subprocess.run([sys.executable, "-m", "voxtile", "push", city, url], capture_output=True, text=True)
    if "unrecognized subcommand" in push.stderr:
        pytest.skip("the module is built without the feature `bucket`")
    assert push.returncode == 0, push.stderr

    assert voxtile.digest(url) == voxtile.digest(city)
    assert voxtile.digest(url, snapshot="early") == voxtile.digest(city, snapshot="early")
    assert voxtile.scan_digest(url) == voxtile.scan_digest(city)
    assert voxtile.verify(url)["damage"] == 0
    assert [found["name"] for found in voxtile.snapshots(url)] == ["early"]
    with voxtile.open(url) as there, voxtile.open(city) as here:
        points = np.array([[0.1, 0.2, 0.3], [1.0, 1.0, 0.5]])
        np.testing.assert_array_equal(there.occupancy(points), here.occupancy(points))
    scans = [list(voxtile.scans(place)) for place in (url, city)]
    assert len(scans[0]) == len(scans[1]) == len(room)
    for (there_points, *_), (here_points, *_) in zip(*scans):
        np.testing.assert_array_equal(there_points, here_points)

    for place, name in ((url, "there"), (city, "here")):
        voxtile.remap_as(place, tmp_path / name, resolution=0.5)
        voxtile.crop(place, tmp_path / f"part_{name}", [[0, 0, 0], [4, 4, 4]], keep_scans=True)
    assert voxtile.digest(tmp_path / "there") == voxtile.digest(tmp_path / "here")
    assert voxtile.digest(tmp_path / "part_there") == voxtile.digest(tmp_path / "part_here")
    assert voxtile.scan_digest(tmp_path / "part_there") == voxtile.scan_digest(tmp_path / "part_here")
    for change in (voxtile.Map.open, lambda map: voxtile.remap(map, {}), lambda map: voxtile.repair(map)):
        with pytest.raises(errors.ArgumentError, match="read-only"):
            change(url)
    shutil.rmtree(city)
    assert voxtile.verify(url)["damage"] == 0
