"""Random scans, and a naive map to compare with."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

Scan = tuple[NDArray[np.float32], NDArray[np.float64]]


class NaiveMap:
    """OctoMap's log-odds, updated once per scan. Rays are walked voxel by voxel at exact crossings; a dict stores
    the voxels.
    """

    HIT, MISS, MIN, MAX = (float(np.log(p / (1 - p))) for p in (0.7, 0.4, 0.1192, 0.971))

    def __init__(self, resolution: float) -> None:
        self.resolution = resolution
        self.voxels: dict[tuple[int, ...], list[float]] = {}

    def key(self, point: NDArray[np.float64]) -> tuple[int, ...]:
        return tuple(np.floor(point / self.resolution).astype(int).tolist())

    def ray(self, origin: NDArray[np.float64], end: NDArray[np.float64]) -> list[tuple[int, ...]]:
        start, stop = origin / self.resolution, end / self.resolution
        times = [0.0, 1.0]
        for a, b in zip(start, stop):
            borders = np.arange(np.ceil(min(a, b)), np.floor(max(a, b)) + 1)
            times += [] if a == b else ((borders - a) / (b - a)).tolist()
        cuts = np.unique(np.clip(times, 0, 1))
        middles = start + ((cuts[1:] + cuts[:-1]) / 2)[:, None] * (stop - start)
        return [tuple(np.floor(middle).astype(int).tolist()) for middle in middles]

    def insert(self, points: NDArray[np.float64], origin: NDArray[np.float64]) -> None:
        hits = {self.key(point) for point in points}
        misses = {voxel for point in points for voxel in self.ray(origin, point)} - hits
        for voxels, step in ((hits, self.HIT), (misses, self.MISS)):
            for voxel in voxels:
                state = self.voxels.setdefault(voxel, [0.0, 0])
                state[0] = min(max(state[0] + step, self.MIN), self.MAX)
                state[1] += 1


def scans_of(seed: int, count: int = 4, points: int = 300) -> list[Scan]:
    """Generates scans of a room in the sensor's frame, and poses as x y z qx qy qz qw."""
    random = np.random.default_rng(seed)
    scans = []
    for number in range(count):
        angles = random.uniform(-np.pi, np.pi, points)
        distances = random.uniform(2.0, 5.0, points)
        heights = random.uniform(-1.0, 1.0, points)
        cloud = np.stack([distances * np.cos(angles), distances * np.sin(angles), heights], axis=1)
        yaw = random.uniform(-np.pi, np.pi)
        pose = np.array([0.31 * number, 0.17, 0.53, 0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)])
        scans.append((cloud.astype(np.float32), pose))
    return scans


def matrix_of(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns the matrix of a pose that rotates only about z."""
    x, y, z, _, _, sine, cosine = pose
    yaw = 2 * np.arctan2(sine, cosine)
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, z], [0, 0, 0, 1]])


@pytest.fixture
def room() -> list[Scan]:
    """A few scans of a room."""
    return scans_of(7)


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """Scans along a street, seven metres apart."""
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
