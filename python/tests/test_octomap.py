"""Comparison with OctoMap, through the package `pyoctomap`."""

from pathlib import Path

import numpy as np
import pytest
import voxtile
from conftest import matrix_of, scans_of

pyoctomap = pytest.importorskip("pyoctomap")


def test_equals_octomap(tmp_path: Path) -> None:
    tree = pyoctomap.OcTree(0.25)
    with voxtile.Map.create(tmp_path / "map", 0.25) as found:
        for points, pose in scans_of(11, count=6, points=2000):
            world = points.astype(np.float64) @ matrix_of(pose)[:3, :3].T + pose[:3]
            # OctoMap's points have single precision.
            world = world.astype(np.float32).astype(np.float64)
            found.insert(world, origin=pose[:3].astype(np.float32))
            tree.insertPointCloud(world, pose[:3].astype(np.float32).astype(np.float64))
        keys = np.stack(np.meshgrid(*(np.arange(-26, 34),) * 2, np.arange(-6, 10), indexing="ij"), -1).reshape(-1, 3)
        centers = (keys + 0.5) * 0.25
        nodes = [tree.search(center) for center in centers]
        theirs = np.array([np.nan if node is None else node.getLogOdds() for node in nodes])
        ours = found.log_odds(centers)
        same = np.isclose(ours, theirs, atol=1e-5, equal_nan=True)
        known = int(np.count_nonzero(~np.isnan(theirs)))
        assert known > 10_000
        # OctoMap accumulates rounding errors along a ray, so it updates a few other voxels.
        assert np.count_nonzero(~same) <= known // 1000


def test_a_file_of_octomap_is_a_map(tmp_path: Path) -> None:
    tree = pyoctomap.OcTree(0.5)
    points = np.array([[3.25, 0.25, 0.25], [3.25, 1.25, 0.75], [-2.75, 0.25, 0.25]])
    tree.insertPointCloud(points, np.array([0.25, 0.25, 0.25]))
    assert tree.writeBinary(str(tmp_path / "tree.bt"))
    with voxtile.open(tmp_path / "tree.bt") as found:
        assert found.resolution == 0.5
        assert found.occupancy(points).tolist() == [1, 1, 1]
        assert found.occupancy([[1.25, 0.25, 0.25], [9.0, 9.0, 9.0]]).tolist() == [0, -1]
