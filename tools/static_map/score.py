#!/usr/bin/env python3
"""Measures how well a map keeps surfaces and removes moving objects.

    score.py SET MAP.npz RESOLUTION_M MIN_RANGE_M MAX_RANGE_M [--by-distance]

SET has scans/*.pcd (binary, with x, y, z and perhaps `label`: 0 static, 1 parked, 2 moving, 3 parked car that leaves,
other: no label), or depth images in millimetres (scans/*.png) and camera-intrinsics.txt; and poses_kitti.txt. MAP.npz
is the output of `voxtile export MAP -o MAP.npz`. Prints the cells of a table row, all in percent:

- the share of points in occupied voxels,
- static accuracy SA: static and parked points in occupied voxels,
- dynamic accuracy DA: moving points not in occupied voxels,
- AA = sqrt(SA DA),
- DA of moving points whose voxels contain no static or parked point,
- points of parked cars that leave in occupied voxels.

SA, DA and AA are the measures of Zhang et al., "A Dynamic Points Removal Benchmark in Point Cloud Maps" (2023), for
voxels in place of points. With --by-distance, prints a second line of eight cells: SA, then DA, of points at most 10,
20 and 35 m from the sensor, and beyond.
"""
import math
import re
import sys
from pathlib import Path

import numpy as np

# Upper ends of the bands of distance from the sensor, in metres.
BANDS_M = [10, 20, 35, math.inf]


class Scans:
    """Scans of a set whose points are within a range of the sensor. Iterates over points in the world frame, shape
    (n, 3), distances from the sensor, shape (n,), in metres, and labels, shape (n,), or None."""

    def __init__(self, folder, min_range_m, max_range_m):
        self.files = sorted(folder.glob("scans/*.p[cn][dg]"), key=natural)
        intrinsics = folder / "camera-intrinsics.txt"
        self.camera = np.loadtxt(intrinsics) if intrinsics.exists() else None
        self.poses = np.loadtxt(folder / "poses_kitti.txt").reshape(-1, 3, 4)
        self.range_m = min_range_m, max_range_m

    def __iter__(self):
        for world, distance_m, labels, _ in self.with_selection():
            yield world, distance_m, labels

    def with_selection(self):
        """Also yields which points of the file are within the range, shape (all points,)."""
        for path, pose in zip(self.files, self.poses):
            xyz, labels = points_of(path) if self.camera is None else (points_of_image(path, self.camera), None)
            distance_m = np.linalg.norm(xyz, axis=1)
            used = (distance_m > self.range_m[0]) & (distance_m < self.range_m[1])
            world = xyz[used] @ pose[:, :3].T + pose[:, 3]
            yield world, distance_m[used], None if labels is None else labels[used], used


def natural(path):
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", path.name)]


def fields_of(path):
    """Returns the points of a binary PCD file as records."""
    head, _, body = path.read_bytes().partition(b"DATA binary\n")
    lines = (line.split() for line in head.decode("latin1").splitlines() if line and not line.startswith("#"))
    entries = {line[0]: line[1:] for line in lines}
    kinds = {"F": "<f", "I": "<i", "U": "<u"}
    fields = zip(entries["FIELDS"], entries["TYPE"], entries["SIZE"], entries["COUNT"])
    record = np.dtype([(name, kinds[kind] + size, (int(count),)) for name, kind, size, count in fields])
    return np.frombuffer(body, record, int(entries["POINTS"][0]))


def points_of(path):
    """Returns points in the sensor's frame, shape (n, 3), and labels, shape (n,), or None."""
    points = fields_of(path)
    xyz = np.stack([points[axis][:, 0] for axis in "xyz"], axis=1).astype(np.float64)
    labels = points["label"][:, 0] if "label" in points.dtype.names else None
    return xyz, labels


def points_of_image(path, camera):
    """Returns the points of a depth image, shape (n, 3). `camera` is the matrix of intrinsics, shape (3, 3)."""
    from PIL import Image

    depth_m = np.asarray(Image.open(path)).astype(np.float64) / 1000
    row, column = np.nonzero((depth_m > 0) & (depth_m < 65))
    z = depth_m[row, column]
    return np.stack([(column - camera[0, 2]) * z / camera[0, 0], (row - camera[1, 2]) * z / camera[1, 1], z], axis=1)


def keys_of(points, resolution_m):
    """Returns an integer for the voxel of each point."""
    voxels = np.floor(points / resolution_m).astype(np.int64) + (1 << 20)
    return voxels @ np.array([1 << 42, 1 << 21, 1], dtype=np.int64)


def voxels_of(map_file, resolution_m):
    """Returns the sorted keys of the occupied and of the free voxels in an exported file."""
    with np.load(map_file) as voxels:
        is_occupied = voxels["log_odds"] >= 0
        keys = keys_of(voxels["xyz"], resolution_m)
    return np.sort(keys[is_occupied]), np.sort(keys[~is_occupied])


def contains(sorted_keys, keys):
    """Returns whether each key is among the sorted ones, shape (n,)."""
    if not len(sorted_keys):
        return np.zeros(len(keys), bool)
    return sorted_keys[np.searchsorted(sorted_keys, keys).clip(max=len(sorted_keys) - 1)] == keys


class Tally:
    """Numbers of points and of kept points by kind and band of distance. Kinds: static or parked, moving, moving in
    voxels without static points, departing."""

    def __init__(self, static):
        """`static`: sorted keys of the voxels with static or parked points."""
        self.static = static
        self.kept, self.count = np.zeros((2, 4, len(BANDS_M)), np.int64)

    def add(self, keys, is_kept, labels, distance_m):
        band = np.searchsorted(BANDS_M, distance_m)
        is_moving = labels == 2
        is_alone = is_moving.copy()
        is_alone[is_moving] = ~contains(self.static, keys[is_moving])
        for kind, chosen in enumerate([labels <= 1, is_moving, is_alone, labels == 3]):
            self.count[kind] += np.bincount(band[chosen], minlength=len(BANDS_M))
            self.kept[kind] += np.bincount(band[chosen & is_kept], minlength=len(BANDS_M))

    def cells(self):
        """Returns SA, DA, AA, DA of voxels without static points, and the share of kept points of departing cars."""
        count = self.count.sum(1)
        if not (count[0] and count[1]):
            return [""] * 5
        sa, moving, alone, departing = 100 * self.kept.sum(1) / count.clip(min=1)
        cells = [f"{x:.1f}" for x in [sa, 100 - moving, math.sqrt(sa * (100 - moving)), 100 - alone]]
        return cells + [f"{departing:.1f}" if count[3] else ""]

    def cells_by_distance(self):
        """Returns SA of each band and DA of each band."""
        def shares(kind, invert):
            pairs = zip(self.kept[kind], self.count[kind])
            return [f"{100 * (n - kept if invert else kept) / n:.1f}" if n else "" for kept, n in pairs]

        return shares(0, False) + shares(1, True)


def keys_of_static_points(scans, resolution_m):
    """Returns the sorted keys of the voxels with static or parked points."""
    keys = [np.zeros(0, np.int64)]
    for points, _, labels in scans:
        if labels is not None:
            keys.append(np.unique(keys_of(points[labels <= 1], resolution_m)))
    return np.unique(np.concatenate(keys))


def main():
    arguments = [argument for argument in sys.argv[1:] if not argument.startswith("--")]
    folder, map_file = Path(arguments[0]), arguments[1]
    resolution_m, min_range_m, max_range_m = map(float, arguments[2:])
    occupied, _ = voxels_of(map_file, resolution_m)
    scans = Scans(folder, min_range_m, max_range_m)
    tally, kept, count = Tally(keys_of_static_points(scans, resolution_m)), 0, 0
    for points, distance_m, labels in scans:
        keys = keys_of(points, resolution_m)
        hit = contains(occupied, keys)
        kept, count = kept + np.count_nonzero(hit), count + len(hit)
        if labels is not None:
            tally.add(keys, hit, labels, distance_m)
    print(" | ".join([f"{100 * kept / max(count, 1):.1f}"] + tally.cells()))
    if "--by-distance" in sys.argv:
        print(" | ".join(tally.cells_by_distance()))


if __name__ == "__main__":
    main()
