"""Measures how long a client waits for large messages of a node, over one middleware.

message_sizes.py scan FILE                            writes a PLY file: half of the voxels of 0.1 m in a cube of 20 m
message_sizes.py cyclonedds|fastdds|zenoh DOMAIN PORT prints the bytes and seconds of octomap_point_cloud_centers and of
                                                      the service octomap_full, `-` if nothing arrives in a minute

The time is that from creating the subscription, or sending the request, until the message is decoded.
"""

import os
import sys
import threading
import time

LIMIT_S = 60.0
TOPIC, SERVICE = "/octomap_point_cloud_centers", "/octomap_full"


def write_scan(file):
    import numpy as np

    centers = np.arange(-9.95, 10, 0.1, dtype="<f4")
    points = np.stack(np.meshgrid(centers, centers, centers), axis=-1).reshape(-1, 3)
    points = points[np.random.default_rng(1).random(len(points)) < 0.5]
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    head += [f"property float {axis}" for axis in "xyz"] + ["end_header", ""]
    with open(file, "wb") as out:
        out.write("\n".join(head).encode() + points.tobytes())


def waited(is_so, step=lambda: time.sleep(0.001)):
    """Returns the seconds until something is so, or None."""
    began = time.monotonic()
    while not is_so():
        step()
        if time.monotonic() - began > LIMIT_S:
            return None
    return time.monotonic() - began


def report(name, size, seconds):
    print(name, "-" if seconds is None else size, "-" if seconds is None else f"{seconds:.2f}", flush=True)


def cyclonedds(domain, _port):
    from cyclonedds.core import Policy, Qos
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.pub import DataWriter
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic
    from ros_messages import LATCHED, RELIABLE, SERVICES, VOLATILE, PointCloud2

    participant, got = DomainParticipant(domain), []
    topic = Topic(participant, "rt" + TOPIC, PointCloud2)
    reader = DataReader(participant, topic, qos=Qos(RELIABLE, LATCHED, Policy.History.KeepLast(1)))
    seconds = waited(lambda: got.extend(reader.take(1)) or got)
    report("topic", got and len(got[0].data), seconds)
    request, response = SERVICES[SERVICE[1:]]
    qos = Qos(RELIABLE, VOLATILE, Policy.History.KeepLast(10))
    writer = DataWriter(participant, Topic(participant, f"rq{SERVICE}Request", request), qos=qos)
    reader = DataReader(participant, Topic(participant, f"rr{SERVICE}Reply", response), qos=qos)
    waited(lambda: writer.get_matched_subscriptions() and reader.get_matched_publications())
    got = []
    writer.write(request(1, 1, 0))
    seconds = waited(lambda: got.extend(reader.take(1)) or got)
    report("service", got and len(got[0].map.data), seconds)


def fastdds(domain, _port):
    os.environ.update(
        ROS_DOMAIN_ID=str(domain), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST", RMW_IMPLEMENTATION="rmw_fastrtps_cpp"
    )
    import rclpy
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
    from sensor_msgs.msg import PointCloud2

    rclpy.init()
    node, got = rclpy.create_node("planner"), []
    latched = dict(reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(PointCloud2, TOPIC, got.append, QoSProfile(depth=1, **latched))
    seconds = waited(lambda: got, lambda: rclpy.spin_once(node, timeout_sec=0.01))
    report("topic", got and len(got[0].data), seconds)
    # The node refuses responses of more than 64 kB, with the reason in its log.
    print("service - -")
    rclpy.shutdown()


def zenoh(domain, port):
    from ros_messages import SERVICE_TYPES, PointCloud2, service
    from zenoh_graph import SESSIONS, Graph

    graph, got = Graph(port, domain), []
    arrived = threading.Event()

    def take(cdr):
        got.append(PointCloud2.deserialize(cdr))
        arrived.set()

    graph.subscription(TOPIC, "sensor_msgs/PointCloud2", take, latched=True, depth=1)
    seconds = waited(arrived.is_set)
    report("topic", got and len(got[0].data), seconds)
    kind = SERVICE_TYPES[SERVICE[1:]]
    request, response = service(*kind, {})
    call, _ = graph.client(SERVICE, f"{kind[0]}/{kind[1]}")
    began = time.monotonic()
    answer = response.deserialize(call(bytes(request(0).serialize())))
    report("service", len(answer.map.data), time.monotonic() - began)
    for session in SESSIONS:
        session.close()


def main():
    if sys.argv[1] == "scan":
        write_scan(sys.argv[2])
    else:
        clients = {"cyclonedds": cyclonedds, "fastdds": fastdds, "zenoh": zenoh}
        clients[sys.argv[1]](int(sys.argv[2]), int(sys.argv[3]))


main()
