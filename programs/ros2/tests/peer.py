"""An independent ROS 2 peer (Cyclone DDS): writes a bag of clouds and tf, and publishes the same messages.

peer.py DOMAIN BAG CLOUDS [hostile | variants | real FOLDER]

variants: the same points as organised clouds, big-endian, in double precision with fields in another order.
real: the PCD files of a folder, at its poses (poses_tum.txt).
"""

import sys
import time
from pathlib import Path

import numpy as np
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from ros_messages import (
    BEST,
    LATCHED,
    RELIABLE,
    VOLATILE,
    Header,
    PointCloud2,
    PointField,
    Quaternion,
    TFMessage,
    Time,
    Transform,
    TransformStamped,
    Vector3,
)

START_S = 1_700_000_000


def header(stamp_ns, frame):
    return Header(Time(START_S + stamp_ns // 10**9, stamp_ns % 10**9), frame)


def transform(stamp_ns, parent, child, x, yaw):
    turn = Quaternion(0.0, 0.0, float(np.sin(yaw / 2)), float(np.cos(yaw / 2)))
    return TransformStamped(header(stamp_ns, parent), child, Transform(Vector3(x, 0.5, 0.0), turn))


def cloud(stamp_ns, seed):
    """A room of 8 m x 6 m x 3 m as a turning sensor sees it; every 50th ray comes back with nothing."""
    random = np.random.default_rng(seed)
    rays = random.normal(size=(2000, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    reach = np.min(np.array([4.0, 3.0, 1.5]) / np.maximum(np.abs(rays), 1e-9), axis=1)
    points = np.zeros((2000, 4), np.float32)
    points[:, :3] = rays * reach[:, None]
    points[::50, :3] = np.nan
    points[:, 3] = random.uniform(0, 100, 2000)
    fields = [PointField(name, 4 * k, 7, 1) for k, name in enumerate(["x", "y", "z", "intensity"])]
    data = points.tobytes()
    return PointCloud2(header(stamp_ns, "lidar"), 1, 2000, fields, False, 16, len(data), data, False)


def variant(plain, number):
    """The same points in another layout."""
    points = np.frombuffer(plain.data, "<f4").reshape(-1, 4)
    if number % 3 == 0:
        # Organised, with room behind each row.
        rows = points.reshape(4, -1).view(np.uint8).reshape(4, -1)
        data = np.pad(rows, ((0, 0), (0, 24)), constant_values=255).tobytes()
        return PointCloud2(plain.header, 4, 500, plain.fields, False, 16, len(data) // 4, data, False)
    if number % 3 == 1:
        data = points.astype(">f4").tobytes()
        return PointCloud2(plain.header, 1, 2000, plain.fields, True, 16, len(data), data, False)
    layout = {"names": ["intensity", "z", "y", "x"], "formats": ["<f4", "<f8", "<f8", "<f8"]}
    rows = np.zeros(2000, {**layout, "offsets": [0, 8, 16, 24], "itemsize": 40})
    for k, name in enumerate(["x", "y", "z", "intensity"]):
        rows[name] = points[:, k]
    fields = [PointField(name, 8 * k, 7 if k == 0 else 8, 1) for k, name in enumerate(layout["names"])]
    data = rows.tobytes()
    return PointCloud2(plain.header, 1, 2000, fields, False, 40, len(data), data, False)


def real_messages(clouds, folder):
    """A recording: each cloud comes with the pose at its stamp."""
    poses = [line.split() for line in open(folder / "poses_tum.txt") if not line.startswith("#")]
    files = sorted((folder / "scans").glob("*.pcd"))
    for tick, (file, pose) in enumerate(list(zip(files, poses))[:clouds]):
        head, points = file.read_bytes().split(b"DATA binary\n", 1)
        assert b"FIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\n" in head
        stamp = header(tick * 100_000_000, "map")
        place, turn = [float(at) for at in pose[1:4]], [float(at) for at in pose[4:8]]
        yield "/tf", TFMessage([TransformStamped(stamp, "lidar", Transform(Vector3(*place), Quaternion(*turn)))])
        fields = [PointField(name, 4 * k, 7, 1) for k, name in enumerate(["x", "y", "z", "intensity"])]
        count = len(points) // 16
        lidar = header(tick * 100_000_000, "lidar")
        yield "/cloud_in", PointCloud2(lidar, 1, count, fields, False, 16, len(points), points, False)


def messages(clouds, kind, folder):
    """Topic and message, in the order in which a robot sends them: transforms at 50 Hz, clouds at 10 Hz between."""
    if kind == "real":
        yield from real_messages(clouds, Path(folder))
        return
    yield "/tf_static", TFMessage([transform(0, "base", "lidar", 0.2, 0.1)])
    for tick in range(5 * clouds + 2):
        stamp_ns = tick * 20_000_000
        odometry = transform(stamp_ns, "odom", "base", tick * 0.01, tick * 0.02)
        moving = [transform(stamp_ns, "map", "odom", 1.0, 0.0), odometry]
        yield "/tf", TFMessage(moving)
        if tick % 5 == 0 and tick // 5 < clouds:
            plain = cloud(stamp_ns + 7_000_000, tick)
            yield "/cloud_in", variant(plain, tick // 5) if kind == "variants" else plain


TYPES = {
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/cloud_in": "sensor_msgs/msg/PointCloud2",
}


def write_bag(path, clouds, kind, folder):
    store = get_typestore(Stores.ROS2_JAZZY)
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        topics = {name: bag.add_connection(name, kind, typestore=store) for name, kind in TYPES.items()}
        for number, (name, message) in enumerate(messages(clouds, kind, folder)):
            bag.write(topics[name], START_S * 10**9 + number, bytes(message.serialize()))


def main():
    domain, bag, clouds = int(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
    kind, folder = (*sys.argv[4:], "", "")[:2]
    write_bag(bag, clouds, kind, folder)
    participant = DomainParticipant(domain)

    def writer(name, kind, *policies):
        return DataWriter(participant, Topic(participant, "rt" + name, kind), qos=Qos(*policies))

    writers = {
        "/tf_static": writer("/tf_static", TFMessage, RELIABLE, LATCHED, Policy.History.KeepLast(1)),
        "/tf": writer("/tf", TFMessage, RELIABLE, VOLATILE, Policy.History.KeepLast(100)),
        "/cloud_in": writer("/cloud_in", PointCloud2, BEST, VOLATILE, Policy.History.KeepLast(5)),
    }
    until = time.time() + 20
    while not all(one.get_matched_subscriptions() for one in writers.values()):
        if time.time() > until:
            sys.exit("no node answers")
        time.sleep(0.02)
    time.sleep(0.5)
    for name, message in messages(clouds, kind, folder):
        if kind == "hostile" and name == "/cloud_in":
            liar = cloud(0, 1)
            liar.header.stamp = message.header.stamp
            liar.height = liar.width = liar.row_step = 2**32 - 1
            writers[name].write(liar)
            liar.fields = []
            writers[name].write(liar)
        writers[name].write(message)
        time.sleep(0.05 if kind == "real" else 0.02)
    time.sleep(1.5)


main()
