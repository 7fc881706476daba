"""Records a drive without poses, and compares the map of KISS-ICP's poses with that of the true poses; see kiss_icp.sh.

    kiss_icp.py record STREAM FOLDER
    kiss_icp.py align TRUE_TUM FOUND_KITTI ALIGNED_TUM
    kiss_icp.py compare NAME TRUE.npz FOUND.npz RESOLUTION [--shown-only]

`record` reads a scan stream of a drive and writes FOLDER/drive.bag, and FOLDER/true_tum.txt with its poses. `align`
aligns the true poses with the found ones at the scan FIRST, and prints the drift from there. `align` and
`compare` exit with 1 beyond the bounds below.
"""

import struct
import sys
from pathlib import Path

import numpy as np
from ros import Ros
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores

START_NS = 1_700_000_000_123_456_789
PERIOD_NS = 100_000_000
# KISS-ICP assumes that the vehicle is at rest at the beginning. This one moves, so the first scans are left out.
FIRST = 10

# Minimum share of each map's occupied voxels with an occupied voxel of the other map within N voxels.
MIN_WITHIN = {1: 0.95, 2: 0.98}
# Maximum drift, as a share of the distance driven.
MAX_DRIFT = 0.01


def read_stream(path):
    """Yields the position of each scan and its points in the frame of the stream; docs/format.md has the bytes."""
    with open(path, "rb") as file:
        assert file.read(8) == b"VXSCANS\n", f"{path}: not a scan stream"
        version, has_intensities, label_bytes = struct.unpack("<3I", file.read(12))
        assert version == 1, f"{path}: version {version}"
        file.read(label_bytes)
        while head := file.read(60):
            count, *numbers = struct.unpack("<I7d", head)
            assert numbers[3:] == [0, 0, 0, 1], "the workload's scans are not turned"
            rows = np.fromfile(file, "<f4", count * (4 if has_intensities else 3)).reshape(count, -1)
            intensity = rows[:, 3] if has_intensities else np.zeros(count, np.float32)
            yield np.array(numbers[:3]), rows[:, :3], intensity


def headings(positions):
    """Yaw at each position, along the trajectory."""
    steps = np.gradient(positions, axis=0)
    return np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))


def turn(yaw):
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def tum(stamp_ns, position, yaw):
    numbers = [*position, 0, 0, np.sin(yaw / 2), np.cos(yaw / 2)]
    return f"{stamp_ns // 10**9}.{stamp_ns % 10**9:09d} " + " ".join(repr(float(x)) for x in numbers) + "\n"


def record(stream, folder):
    positions, points, intensities = zip(*read_stream(stream))
    positions = np.array(positions)
    yaws = headings(positions)
    stamps = [START_NS + k * PERIOD_NS for k in range(len(yaws))]
    ros, kind = Ros(Stores.ROS1_NOETIC, True), "sensor_msgs/msg/PointCloud2"
    with Writer(folder / "drive.bag") as bag:
        clouds = bag.add_connection("/points", kind, typestore=ros.store)
        for stamp_ns, yaw, xyz, intensity in zip(stamps, yaws, points, intensities):
            # The stream's points have world axes; the sensor turns with the vehicle.
            in_sensor = xyz.astype(float) @ turn(yaw)
            bag.write(clouds, stamp_ns, ros.serialize(ros.cloud(stamp_ns, in_sensor, intensity), kind))
    (folder / "true_tum.txt").write_text("".join(map(tum, stamps, positions, yaws)))
    distance_m = np.linalg.norm(np.diff(positions, axis=0), axis=1).sum()
    print(f"{len(yaws)} scans of {np.mean([len(xyz) for xyz in points]):.0f} points, {distance_m:.0f} m, ", end="")
    print(f"{np.degrees(np.abs(np.diff(yaws)).sum()):.0f} degrees of turns")


def align(true, found, aligned):
    lines = Path(true).read_text().splitlines()
    numbers = np.loadtxt(true)
    yaws = 2 * np.arctan2(numbers[:, 6], numbers[:, 7])
    true = np.array([np.eye(4)] * len(numbers))
    true[:, :3, :3], true[:, :3, 3] = [turn(yaw) for yaw in yaws], numbers[:, 1:4]
    found = np.loadtxt(found).reshape(-1, 3, 4)
    assert len(found) == len(true), f"{len(found)} poses of {len(true)} scans"
    first = np.vstack([found[FIRST], [0, 0, 0, 1]])
    true = first @ np.linalg.inv(true[FIRST]) @ true
    with open(aligned, "w") as file:
        for line, pose in zip(lines, true):
            xyzw = quaternion(pose[:3, :3])
            file.write(" ".join([line.split()[0], *(repr(float(x)) for x in [*pose[:3, 3], *xyzw])]) + "\n")
    true, found = true[FIRST:], found[FIRST:]
    off_m = np.linalg.norm(true[:, :3, 3] - found[:, :3, 3], axis=1)
    distance_m = np.linalg.norm(np.diff(true[:, :3, 3], axis=0), axis=1).sum()
    turned = np.trace(np.swapaxes(true[:, :3, :3], 1, 2) @ found[:, :3, :3], axis1=1, axis2=2)
    off_deg = np.degrees(np.arccos(np.clip((turned - 1) / 2, -1, 1)))
    print(f"poses: off by {off_m.mean():.3f} m on average, {off_m.max():.3f} m at most, ", end="")
    print(f"{off_deg.max():.2f} degrees at most; ", end="")
    print(f"{off_m[-1]:.3f} m after {distance_m:.0f} m, that is {off_m[-1] / distance_m:.2%}")
    return off_m[-1] > MAX_DRIFT * distance_m


def quaternion(matrix):
    """Quaternion x y z w of a rotation matrix: eigenvector of the largest eigenvalue of a symmetric 4x4 matrix."""
    (a, b, c), (d, e, f), (g, h, i) = matrix
    symmetric = np.array([
        [a - e - i, b + d, c + g, h - f],
        [b + d, e - a - i, f + h, c - g],
        [c + g, f + h, i - a - e, d - b],
        [h - f, c - g, d - b, a + e + i],
    ])
    return np.linalg.eigh(symmetric)[1][:, -1]


def packed(index):
    """Integers, one per voxel, in the order of the indices."""
    index = index + (1 << 20)
    return (index[:, 0] << 42) | (index[:, 1] << 21) | index[:, 2]


def share_within(index, other, voxels):
    """Share of the voxels with one of `other` within `voxels` along every axis."""
    steps = range(-voxels, voxels + 1)
    there, near = np.sort(packed(other)), np.zeros(len(index), bool)
    for step in [(x, y, z) for x in steps for y in steps for z in steps]:
        neighbour = packed(index + step)
        at = np.minimum(np.searchsorted(there, neighbour), len(there) - 1)
        near |= there[at] == neighbour
    return near.mean()


def compare(name, true, found, resolution):
    true, found = (np.floor(np.load(path)["xyz"] / resolution).astype(np.int64) for path in (true, found))
    failed = False
    print(f"{name}: {len(found)} voxels occupied, {len(true)} with the true poses; ", end="")
    for voxels, least in MIN_WITHIN.items():
        forth, back = share_within(found, true, voxels), share_within(true, found, voxels)
        print(f"within {voxels}: {forth:.4f} and back {back:.4f}", end="; " if voxels < 2 else "\n")
        failed |= min(forth, back) < least
    return failed


def main():
    match sys.argv[1:]:
        case ["record", stream, folder]:
            record(stream, Path(folder))
        case ["align", true, found, aligned]:
            sys.exit(bool(align(true, found, aligned)))
        case ["compare", name, true, found, resolution]:
            sys.exit(bool(compare(name, true, found, float(resolution))))
        case ["compare", name, true, found, resolution, "--shown-only"]:
            compare(name, true, found, float(resolution))
        case _:
            sys.exit(__doc__)


main()
