#!/usr/bin/env python3
"""Measures how well a map keeps surfaces and removes moving objects.

    score.py SET MAP.npz RESOLUTION_M MIN_RANGE_M MAX_RANGE_M

SET has scans/*.pcd (binary, with x, y, z and perhaps `label`: 0 static, 1 parked, 2 moving, other: no label), or depth
images in millimetres (scans/*.png) and camera-intrinsics.txt; and poses_kitti.txt. MAP.npz is the output of `voxtile export MAP -o MAP.npz --what all`. Prints the cells of a table row:
the share of points in occupied voxels and, with labels, the static accuracy (SA: static points in occupied voxels), the
dynamic accuracy (DA: moving points not in occupied voxels) and AA = sqrt(SA DA), all in percent. These are the measures
of Zhang et al., "A Dynamic Points Removal Benchmark in Point Cloud Maps" (2023), for voxels in place of points.
"""
import math
import re
import sys
from pathlib import Path

import numpy as np

def natural(path):
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", path.name)]


def points_of(path):
    """Returns points in the sensor's frame, shape (n, 3), and labels, shape (n,), or None."""
    head, _, body = path.read_bytes().partition(b"DATA binary\n")
    lines = (line.split() for line in head.decode("latin1").splitlines() if line and not line.startswith("#"))
    entries = {line[0]: line[1:] for line in lines}
    kinds = {"F": "<f", "I": "<i", "U": "<u"}
    fields = zip(entries["FIELDS"], entries["TYPE"], entries["SIZE"], entries["COUNT"])
    record = np.dtype([(name, kinds[kind] + size, (int(count),)) for name, kind, size, count in fields])
    points = np.frombuffer(body, record, int(entries["POINTS"][0]))
    xyz = np.stack([points[axis][:, 0] for axis in "xyz"], axis=1).astype(np.float64)
    labels = points["label"][:, 0] if "label" in entries["FIELDS"] else None
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


def main():
    folder, map_file = Path(sys.argv[1]), sys.argv[2]
    resolution_m, min_range_m, max_range_m = map(float, sys.argv[3:])
    with np.load(map_file) as voxels:
        is_occupied = voxels["log_odds"] >= 0
        occupied = np.sort(keys_of(voxels["xyz"], resolution_m)[is_occupied])
    scans = sorted(folder.glob("scans/*.p[cn][dg]"), key=natural)
    intrinsics = folder / "camera-intrinsics.txt"
    camera = np.loadtxt(intrinsics) if intrinsics.exists() else None
    poses = np.loadtxt(folder / "poses_kitti.txt").reshape(-1, 3, 4)
    kept, count = np.zeros(3, np.int64), np.zeros(3, np.int64)  # all, static, moving
    for path, pose in zip(scans, poses):
        xyz, labels = points_of(path) if camera is None else (points_of_image(path, camera), None)
        distance_m = np.linalg.norm(xyz, axis=1)
        used = (distance_m > min_range_m) & (distance_m < max_range_m)
        keys = keys_of(xyz[used] @ pose[:, :3].T + pose[:, 3], resolution_m)
        found = np.searchsorted(occupied, keys).clip(max=len(occupied) - 1)
        hit = occupied[found] == keys
        of_label = [np.ones_like(hit)]
        if labels is not None:
            of_label += [labels[used] <= 1, labels[used] == 2]
        for number, chosen in enumerate(of_label):
            kept[number] += np.count_nonzero(hit & chosen)
            count[number] += np.count_nonzero(chosen)
    cells = [f"{100 * kept[0] / count[0]:.1f}"]
    if count[1] and count[2]:
        sa, da = 100 * kept[1] / count[1], 100 * (1 - kept[2] / count[2])
        cells += [f"{sa:.1f}", f"{da:.1f}", f"{math.sqrt(sa * da):.1f}"]
    print(" | ".join((cells + ["", "", ""])[:4]))


if __name__ == "__main__":
    main()
