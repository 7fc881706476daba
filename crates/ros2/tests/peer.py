"""An independent ROS 2 peer (Cyclone DDS): writes a bag of clouds and tf, and publishes the same messages.

peer.py DOMAIN BAG CLOUDS [hostile | types | variants | odometry | sensors | deskew | path | real FOLDER]

variants: the same points in organised clouds, big-endian, or in double precision with another order of fields.
hostile: sends a malformed cloud and transforms that form loops before each cloud.
types: other participants publish and subscribe to the same topics with other types.
odometry: sends poses as nav_msgs/Odometry, and only the sensor mount on tf.
deskew: points have times; the last ones are after the last transform.
sensors: two sensors whose clouds do not overlap, with their mounts.
rclpy: clouds in the child frame of the odometry, without tf; used by rclpy_peer.py.
path: sends a corrected path after the first CLOUDS, also written to BAG.tum; more clouds follow at once.
real: the PCD files of a folder with its poses (poses_tum.txt).
"""

import pathlib
import sys
import time

import numpy as np
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from ros_messages import (
    BEST,
    LATCHED,
    RELIABLE,
    VOLATILE,
    Header,
    Odometry,
    Path,
    Point,
    PointCloud2,
    PointField,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Quaternion,
    String,
    TFMessage,
    Time,
    Transform,
    TransformStamped,
    Twist,
    TwistWithCovariance,
    Vector3,
)

START_S = 1_700_000_000


def header(stamp_ns, frame):
    return Header(Time(START_S + stamp_ns // 10**9, stamp_ns % 10**9), frame)


def transform(stamp_ns, parent, child, x, yaw):
    turn = Quaternion(0.0, 0.0, float(np.sin(yaw / 2)), float(np.cos(yaw / 2)))
    return TransformStamped(header(stamp_ns, parent), child, Transform(Vector3(x, 0.5, 0.0), turn))


def cloud(stamp_ns, seed):
    """Returns a cloud of a rotating sensor in a room of 8 m x 6 m x 3 m. Every 50th ray has no return."""
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
    """Returns the same points in another layout."""
    points = np.frombuffer(plain.data, "<f4").reshape(-1, 4)
    if number % 3 == 0:
        # Organised, with padding after each row.
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


def attributed(plain):
    """Returns the same points with colours, packed as in PCL, and labels, some of which are no classes."""
    points = np.frombuffer(plain.data, "<f4").reshape(-1, 4)
    rows = np.zeros(len(points), {"names": ["point", "rgb", "label"], "formats": ["4<f4", "<u4", "<u2"], "itemsize": 24})
    rows["point"] = points
    rows["rgb"] = np.nan_to_num(np.abs(points[:, :3]) * 60).astype(np.uint32) @ [1 << 16, 1 << 8, 1]
    rows["label"] = np.where(np.isnan(points[:, 0]), 300, points[:, 3])
    fields = [*plain.fields, PointField("rgb", 16, 7, 1), PointField("label", 20, 4, 1)]
    data = rows.tobytes()
    return PointCloud2(plain.header, 1, len(rows), fields, False, 24, len(data), data, False)


def timed(plain):
    """Returns the same points with the times of a sweep of 120 ms, in nanoseconds after the stamp."""
    points = np.frombuffer(plain.data, "<f4").reshape(-1, 4)
    rows = np.zeros(len(points), {"names": ["point", "t"], "formats": ["4<f4", "<u4"], "itemsize": 20})
    rows["point"] = points
    rows["t"] = np.arange(len(points)) * 60_000
    data = rows.tobytes()
    fields = [*plain.fields, PointField("t", 16, 6, 1)]
    return PointCloud2(plain.header, 1, len(rows), fields, False, 20, len(data), data, False)


def real_messages(clouds, folder):
    """Yields the messages of a recording: each cloud with the pose at its stamp."""
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
    """Yields topics and messages in the order of a robot: transforms at 50 Hz, clouds at 10 Hz between them."""
    if kind == "real":
        yield from real_messages(clouds, pathlib.Path(folder))
        return
    mounts = [transform(0, "base", "lidar", 0.2, 0.1)]
    if kind == "sensors":
        mounts.append(transform(0, "base", "rear", -50.0, 2.0))
    if kind != "rclpy":
        yield "/tf_static", TFMessage(mounts)
    for tick in range(5 * clouds + 2):
        stamp_ns = tick * 20_000_000
        odometry = transform(stamp_ns, "odom", "base", tick * 0.01, tick * 0.02)
        moving = [transform(stamp_ns, "map", "odom", 1.0, 0.0), odometry]
        if kind in ("odometry", "rclpy"):
            at, turn = odometry.transform.translation, odometry.transform.rotation
            pose = PoseWithCovariance(Pose(Point(at.x, at.y, at.z), turn), [0.0] * 36)
            still = TwistWithCovariance(Twist(Vector3(0.0, 0.0, 0.0), Vector3(0.0, 0.0, 0.0)), [0.0] * 36)
            yield "/odom", Odometry(odometry.header, "base", pose, still)
        else:
            yield "/tf", TFMessage(moving)
        if kind == "sensors" and tick % 5 == 2 and tick // 5 < clouds:
            rear = cloud(stamp_ns + 7_000_000, 1000 + tick)
            rear.header.frame_id = "rear"
            yield "/rear", rear
        if tick % 5 == 0 and tick // 5 < clouds:
            plain = cloud(stamp_ns + 7_000_000, tick)
            plain.header.frame_id = "base" if kind == "rclpy" else "lidar"
            changed = {
                "variants": lambda: variant(plain, tick // 5),
                "layers": lambda: attributed(plain),
                "deskew": lambda: timed(plain),
            }
            yield "/cloud_in", changed.get(kind, lambda: plain)()


TYPES = {
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/cloud_in": "sensor_msgs/msg/PointCloud2",
    "/rear": "sensor_msgs/msg/PointCloud2",
    "/odom": "nav_msgs/msg/Odometry",
}


def loops(stamp_ns):
    """Returns transforms that form loops with those of the robot or with each other, and invalid ones."""
    pairs = [("lidar", "map"), ("base", "map"), ("lidar", "base"), ("odom", "odom"), ("", "base"), ("lost", "lidar")]
    wrong = [transform(stamp_ns, parent, child, 7.0, 1.0) for parent, child in pairs]
    bent = transform(stamp_ns, "odom", "base", 0.0, 0.0)
    bent.transform.rotation = Quaternion(float("nan"), 0.0, 0.0, 1.0)
    return TFMessage([*wrong, bent])


def corrected_path(clouds):
    """Returns sensor poses at the stamps of clouds, with increasing drift, and a path with an additional pose."""
    poses = []
    for number in range(clouds):
        drift, yaw = 0.01 * number, 0.1 + 0.03 * number
        turn = Quaternion(0.0, 0.0, float(np.sin(yaw / 2)), float(np.cos(yaw / 2)))
        stamp = header(number * 100_000_000 + 7_000_000, "map")
        poses.append(PoseStamped(stamp, Pose(Point(1.2 + 0.07 * number, 1.0 - drift, 0.3 * drift), turn)))
    lost = PoseStamped(header(50_000_000, "map"), poses[0].pose)
    return poses, Path(header(0, "map"), poses[:1] + [lost] + poses[1:])


# Number of clouds after the path.
LATER = 20


def write_tum(file, poses):
    with open(file, "w") as out:
        for one in poses:
            stamp, at, turn = one.header.stamp, one.pose.position, one.pose.orientation
            numbers = [at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w]
            print(f"{stamp.sec}.{stamp.nanosec:09}", *map(repr, numbers), file=out)


def topics_of(kind):
    """Returns the topics that a robot publishes."""
    if kind == "rclpy":
        return ["/odom", "/cloud_in"]
    poses = "/odom" if kind == "odometry" else "/tf"
    return ["/tf_static", poses, "/cloud_in"] + (["/rear"] if kind == "sensors" else [])


def other_types(domain):
    """Creates writers and readers of the node's topics with other types."""
    participant = DomainParticipant(domain)
    writers = []
    for name, kind in [("cloud_in", String), ("tf", PointCloud2), ("tf_static", String)]:
        writers.append((DataWriter(participant, Topic(participant, "rt/" + name, kind), qos=Qos(RELIABLE)), kind))
    latched = Qos(RELIABLE, LATCHED, Policy.History.KeepLast(1))
    wanted = [DataReader(participant, Topic(participant, "rt/" + name, String), qos=latched) for name in PUBLISHED]
    return participant, writers, wanted


PUBLISHED = ["octomap_binary", "projected_map", "local_inflated"]


def send_other_types(writers, message):
    """Sends messages of other types."""
    for writer, kind in writers:
        writer.write(String("x" * 1000) if kind is String else message)


def write_bag(path, clouds, kind, folder):
    store = get_typestore(Stores.ROS2_JAZZY)
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        names = topics_of(kind)
        topics = {name: bag.add_connection(name, TYPES[name], typestore=store) for name in names}
        for number, (name, message) in enumerate(messages(clouds, kind, folder)):
            bag.write(topics[name], START_S * 10**9 + number, bytes(message.serialize()))


def main():
    domain, bag, clouds = int(sys.argv[1]), pathlib.Path(sys.argv[2]), int(sys.argv[3])
    kind, folder = (*sys.argv[4:], "", "")[:2]
    write_bag(bag, clouds + (LATER if kind == "path" else 0), kind, folder)
    participant = DomainParticipant(domain)

    def writer(name, kind, *policies):
        return DataWriter(participant, Topic(participant, "rt" + name, kind), qos=Qos(*policies))

    writers = {
        "/tf_static": writer("/tf_static", TFMessage, RELIABLE, LATCHED, Policy.History.KeepLast(1)),
        "/cloud_in": writer("/cloud_in", PointCloud2, BEST, VOLATILE, Policy.History.KeepLast(5)),
    }
    if kind == "odometry":
        writers["/odom"] = writer("/odom", Odometry, RELIABLE, VOLATILE, Policy.History.KeepLast(100))
    else:
        writers["/tf"] = writer("/tf", TFMessage, RELIABLE, VOLATILE, Policy.History.KeepLast(100))
    if kind == "sensors":
        writers["/rear"] = writer("/rear", PointCloud2, BEST, VOLATILE, Policy.History.KeepLast(5))
    if kind == "path":
        writers["/slam_path"] = writer("/slam_path", Path, RELIABLE, VOLATILE, Policy.History.KeepLast(1))
    others = other_types(domain) if kind == "types" else None
    until = time.time() + 20
    while not all(one.get_matched_subscriptions() for one in writers.values()):
        if time.time() > until:
            sys.exit("no node answers")
        time.sleep(0.02)
    time.sleep(0.5)
    sent, more = 0, LATER if kind == "path" else 0
    for name, message in messages(clouds + more, kind, folder):
        if more and name == "/cloud_in":
            sent += 1
            if sent == clouds + 1:
                # Wait until the earlier clouds are mapped.
                time.sleep(1.5)
                poses, path = corrected_path(clouds)
                write_tum(f"{bag}.tum", poses)
                writers["/slam_path"].write(path)
                time.sleep(0.3)
        if kind == "hostile" and name == "/cloud_in":
            malformed = cloud(0, 1)
            malformed.header.stamp = message.header.stamp
            malformed.height = malformed.width = malformed.row_step = 2**32 - 1
            writers[name].write(malformed)
            malformed.fields = []
            writers[name].write(malformed)
            stamp = message.header.stamp
            writers["/tf"].write(loops((stamp.sec - START_S) * 10**9 + stamp.nanosec))
        if others and name == "/cloud_in":
            send_other_types(others[1], message)
        writers[name].write(message)
        time.sleep(0.05 if kind == "real" else 0.02)
    time.sleep(3.0 if kind == "path" else 1.5)


if __name__ == "__main__":
    main()
