"""Writes tests/data/scans_1: six small scans with poses, the PCD files by pypcd4.

    fixtures.py OUT_FOLDER
"""

import math
import random
import sys
from pathlib import Path

import numpy as np
from pypcd4 import Encoding, PointCloud

SCANS = 6
POINTS = 300


def scan(number: int) -> np.ndarray:
    """x y z in metres and intensity, sensor frame: a hall of 12 by 8 m, seen from its middle."""
    rng = random.Random(number)
    rows = []
    for _ in range(POINTS):
        azimuth, up = rng.uniform(0, 2 * math.pi), rng.uniform(-0.4, 0.6)
        reach = min(6 / max(abs(math.cos(azimuth)), 1e-9), 4 / max(abs(math.sin(azimuth)), 1e-9))
        rows.append([reach * math.cos(azimuth), reach * math.sin(azimuth), reach * up, rng.randrange(256)])
    return np.array(rows, dtype=np.float32)


def main() -> None:
    folder = Path(sys.argv[1])
    (folder / "scans").mkdir(parents=True, exist_ok=True)
    tum, kitti = ["# timestamp tx ty tz qx qy qz qw"], []
    encodings = [Encoding.BINARY_COMPRESSED, Encoding.BINARY, Encoding.ASCII]
    for number in range(SCANS):
        cloud = PointCloud.from_xyzi_points(scan(number))
        cloud.save(folder / "scans" / f"{number:06}.pcd", encoding=encodings[number % 3])
        yaw, x, y = 0.1 * number, 0.4 * number, 0.05 * number
        tum.append(f"{0.1 * number:.6f} {x:.6f} {y:.6f} 0.500000 0 0 {math.sin(yaw / 2):.9f} {math.cos(yaw / 2):.9f}")
        c, s = math.cos(yaw), math.sin(yaw)
        kitti.append(f"{c:.9f} {-s:.9f} 0 {x:.6f} {s:.9f} {c:.9f} 0 {y:.6f} 0 0 1 0.500000")
    (folder / "poses_tum.txt").write_text("\n".join(tum) + "\n")
    (folder / "poses_kitti.txt").write_text("\n".join(kitti) + "\n")


main()
