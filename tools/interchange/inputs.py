"""Writes the same scans in every format with third-party libraries; `inputs.sh` builds a map from each.

    inputs.py FOLDER [SCANS [POINTS]]

The scans are synthetic: points on the walls of a hall as float32 in the sensor's frame, with intensities, and a smooth
trajectory of quaternions with time stamps in whole nanoseconds.
"""

import sys
from pathlib import Path

import laspy
import numpy as np
import pye57
from plyfile import PlyData, PlyElement
from ros import Ros
from rosbags.rosbag1 import Writer as Bag1Writer
from rosbags.rosbag2 import StoragePlugin, Writer as Bag2Writer
from rosbags.typesys import Stores

START_NS = 1_700_000_000_123_456_789
PERIOD_NS = 100_000_000


def make_scan(rng, points):
    """Points on the faces of a box around the sensor."""
    face = rng.integers(0, 6, points)
    xyz = rng.uniform(-1, 1, (points, 3)) * [9.0, 7.0, 2.5]
    axis = face // 2
    xyz[np.arange(points), axis] = np.where(face % 2 == 0, -1, 1) * np.array([9.0, 7.0, 2.5])[axis]
    return xyz.astype(np.float32), rng.uniform(0, 255, points).astype(np.float32)


def make_poses(scans):
    k = np.arange(scans)
    yaw = 0.05 * k
    position = np.stack([0.4 * k, 0.1 * np.sin(0.3 * k), 1.5 + 0.01 * k], axis=1)
    return [np.array([*position[i], 0, 0, np.sin(yaw[i] / 2), np.cos(yaw[i] / 2)]) for i in range(scans)]


def rotation(q):
    x, y, z, w = q
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])


def write_pcd(path, xyz, intensity):
    rows = np.column_stack([xyz, intensity]).astype("<f4")
    header = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n"
        f"WIDTH {len(rows)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(rows)}\nDATA binary\n"
    )
    path.write_bytes(header.encode() + rows.tobytes())


def write_ply(path, xyz, intensity, text):
    rows = np.empty(len(xyz), dtype=[("x", "f4"), ("y", "f4"), ("z", "f4"), ("intensity", "f4")])
    rows["x"], rows["y"], rows["z"], rows["intensity"] = *xyz.T, intensity
    PlyData([PlyElement.describe(rows, "vertex")], text=text).write(path)


def tum(stamp_ns, pose):
    numbers = " ".join(repr(float(number)) for number in pose)
    return f"{stamp_ns // 10**9}.{stamp_ns % 10**9:09d} {numbers}\n"


def write_bag(writer, ros, scans, poses):
    cloud_type, tf_type = "sensor_msgs/msg/PointCloud2", "tf2_msgs/msg/TFMessage"
    clouds = writer.add_connection("/points", cloud_type, typestore=ros.store)
    tf = writer.add_connection("/tf", tf_type, typestore=ros.store)
    static = writer.add_connection("/tf_static", tf_type, typestore=ros.store)
    mount = ros.tf(START_NS, "base_link", "lidar", [0, 0, 0, 0, 0, 0, 1])
    writer.write(static, START_NS, ros.serialize(mount, tf_type))
    for k, ((xyz, intensity), pose) in enumerate(zip(scans, poses)):
        stamp_ns = START_NS + k * PERIOD_NS
        writer.write(tf, stamp_ns, ros.serialize(ros.tf(stamp_ns, "map", "base_link", pose), tf_type))
        writer.write(clouds, stamp_ns, ros.serialize(ros.cloud(stamp_ns, xyz, intensity), cloud_type))


def write_laz(path, scans, poses):
    """All points in the world frame, each with its own time. Coordinates are rounded to 0.1 mm."""
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = [1e-4] * 3, [0.0] * 3
    header.global_encoding.gps_time_type = laspy.header.GpsTimeType.STANDARD
    las = laspy.LasData(header)
    world = [xyz.astype(float) @ rotation(pose[3:]).T + pose[:3] for (xyz, _), pose in zip(scans, poses)]
    las.x, las.y, las.z = np.concatenate(world).T
    las.intensity = np.concatenate([intensity for _, intensity in scans]).astype(np.uint16)
    shares = [k + np.arange(len(xyz)) / len(xyz) for k, (xyz, _) in enumerate(scans)]
    las.gps_time = 1000 + 0.1 * np.concatenate(shares)
    las.write(path)


def main():
    folder = Path(sys.argv[1])
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 12
    points = int(sys.argv[3]) if len(sys.argv) > 3 else 2000
    rng = np.random.default_rng(1)
    scans, poses = [make_scan(rng, points) for _ in range(count)], make_poses(count)
    stamps = [START_NS + k * PERIOD_NS for k in range(count)]
    lines = "".join(tum(stamp, pose) for stamp, pose in zip(stamps, poses))
    for name in ["pcd", "ply", "ply_text", "kitti", "xyz", "stamped"]:
        (folder / name).mkdir(parents=True)
        (folder / name / "poses_tum.txt").write_text(lines)
    for k, (xyz, intensity) in enumerate(scans):
        write_pcd(folder / "pcd" / f"{k:03d}.pcd", xyz, intensity)
        write_ply(folder / "ply" / f"{k:03d}.ply", xyz, intensity, text=False)
        write_ply(folder / "ply_text" / f"{k:03d}.ply", xyz, intensity, text=True)
        np.column_stack([xyz, intensity]).astype("<f4").tofile(folder / "kitti" / f"{k:03d}.bin")
        rows = [" ".join(repr(float(number)) for number in row) for row in np.column_stack([xyz, intensity])]
        (folder / "xyz" / f"{k:03d}.xyz").write_text("\n".join(rows) + "\n")
        # The file name is the time stamp; the poses are in another order.
        np.column_stack([xyz, intensity]).astype("<f4").tofile(folder / "stamped" / f"{stamps[k]}.bin")
    (folder / "stamped" / "poses_tum.txt").write_text("".join(reversed(lines.splitlines(keepends=True))))
    array = [[stamp / 1e9, *pose] for stamp, pose in zip(stamps, poses)]
    np.save(folder / "poses.npy", np.array(array))

    e57 = pye57.E57(str(folder / "scans.e57"), mode="w")
    for (xyz, intensity), pose in zip(scans, poses):
        x, y, z = xyz.T.astype(float)
        columns = {"cartesianX": x, "cartesianY": y, "cartesianZ": z, "intensity": intensity.astype(float)}
        # Quaternion w x y z.
        e57.write_scan_raw(columns, rotation=pose[[6, 3, 4, 5]], translation=pose[:3])
    e57.close()
    write_laz(folder / "scans.laz", scans, poses)
    # The middle of each scan, in adjusted standard GPS time plus 10^9 seconds.
    middle_ns = 1_000_001_000_050_000_000
    (folder / "laz_poses.txt").write_text("".join(tum(middle_ns + k * PERIOD_NS, pose) for k, pose in enumerate(poses)))
    with Bag1Writer(folder / "scans.bag") as writer:
        write_bag(writer, Ros(Stores.ROS1_NOETIC, True), scans, poses)
    with Bag2Writer(folder / "rosbag2", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        write_bag(writer, Ros(Stores.ROS2_HUMBLE, False), scans, poses)
    with Bag2Writer(folder / "sqlite", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        write_bag(writer, Ros(Stores.ROS2_HUMBLE, False), scans, poses)


main()
