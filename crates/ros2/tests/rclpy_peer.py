"""Node of ROS 2 itself (rclpy of Jazzy over Fast DDS, from PyPI): publishes clouds and odometry, and uses the node's
topics and services.

rclpy_peer.py DOMAIN BAG CLOUDS VOXTILE MAP RADIUS MAX_Z
"""

import csv
import os
import pathlib
import shutil
import subprocess
import sys
import time

os.environ["ROS_DOMAIN_ID"] = sys.argv[1]
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["RMW_IMPLEMENTATION"] = "rmw_fastrtps_cpp"
os.environ["ROS_LOG_DIR"] = str(pathlib.Path(sys.argv[2]).with_suffix(".ros_log"))

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import OccupancyGrid, Odometry
from outputs import pgm_cells
from peer import messages, write_bag
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Empty, Trigger
from visualization_msgs.msg import MarkerArray

LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
NODE = "/voxtile_ros2"


class Peer:
    def __init__(self):
        rclpy.init()
        self.node = rclpy.create_node("planner")
        self.last = {}
        self.clouds = self.node.create_publisher(PointCloud2, "/cloud_in", qos_profile_sensor_data)
        self.odometry = self.node.create_publisher(Odometry, "/odom", 100)
        self.keep_last(PointCloud2, "/octomap_point_cloud_centers", LATCHED)
        self.keep_last(MarkerArray, "/occupied_cells_vis_array", LATCHED)
        self.keep_last(PointCloud2, "/local_inflated", LATCHED)
        self.keep_last(DiagnosticArray, "/diagnostics", 10)

    def keep_last(self, kind, topic, qos):
        """Keeps the last message of a topic."""
        self.node.create_subscription(kind, topic, lambda message: self.last.update({topic: message}), qos)

    def spin(self, seconds):
        until = time.time() + seconds
        while time.time() < until:
            rclpy.spin_once(self.node, timeout_sec=0.01)

    def wait(self, what, is_so, seconds=20):
        until = time.time() + seconds
        while not is_so():
            assert time.time() < until, what
            self.spin(0.05)

    def call(self, kind, service):
        client = self.node.create_client(kind, f"{NODE}/{service}")
        assert client.wait_for_service(20), f"{service} is missing"
        answer = client.call_async(kind.Request())
        self.wait(f"{service} does not answer", answer.done)
        return answer.result()

    def play(self, clouds):
        kinds = {"/cloud_in": (self.clouds, PointCloud2), "/odom": (self.odometry, Odometry)}
        for topic, message in messages(clouds, "rclpy", ""):
            publisher, kind = kinds[topic]
            publisher.publish(deserialize_message(bytes(message.serialize()), kind))
            self.spin(0.02)


def indices(points, resolution):
    return sorted(tuple(round(at / resolution - 0.5) for at in point) for point in points)


def check_outputs(peer, voxtile, folder, origin, radius, max_z):
    """Compares the received messages with the output of `voxtile export` of the saved map."""
    all_csv, pgm = f"{folder}.csv", f"{folder}.pgm"
    for command in [["export", folder, "-o", all_csv], ["export", folder, "-o", pgm, "--z-max", str(max_z)]]:
        subprocess.run([voxtile, *command], check=True, stdout=subprocess.DEVNULL)
    [marker] = peer.last["/occupied_cells_vis_array"].markers
    resolution = marker.scale.x
    near = []
    for row in csv.DictReader(open(all_csv)):
        center = [float(row[axis]) for axis in "xyz"]
        if all(origin[k] - radius <= center[k] < origin[k] + radius for k in range(3)):
            near += [center] if center[2] - resolution / 2 < max_z else []
    wanted = indices(near, resolution)
    assert len(wanted) > 100

    def centers():
        cloud = peer.last["/octomap_point_cloud_centers"]
        return indices(np.frombuffer(cloud.data, "<f4").reshape(-1, 3).tolist(), resolution)

    def cubes():
        [marker] = peer.last["/occupied_cells_vis_array"].markers
        return indices([[point.x, point.y, point.z] for point in marker.points], resolution)

    # Retry, because updates may be delayed on a busy machine.
    for name, found in [("centers", centers), ("cubes", cubes)]:
        peer.wait(f"{name} are not the {len(wanted)} voxels of the map", lambda found=found: found() == wanted)
    # Subscribe late, like the static layer of nav2.
    peer.keep_last(OccupancyGrid, "/projected_map", LATCHED)
    peer.wait("no projected_map for a late subscriber", lambda: "/projected_map" in peer.last)
    grid = peer.last["/projected_map"]
    size, cells = pgm_cells(pgm)
    assert ([grid.info.width, grid.info.height], list(grid.data)) == (size, cells), "projected_map differs"
    inflated = peer.last["/local_inflated"]
    assert inflated.header.frame_id == grid.header.frame_id == "odom" and inflated.width > len(wanted) / 2
    return f"{len(wanted)} voxels, {size} cells, {inflated.width} inflated"


def main():
    bag, clouds = pathlib.Path(sys.argv[2]), int(sys.argv[3])
    voxtile, folder, radius, max_z = sys.argv[4], sys.argv[5], float(sys.argv[6]), float(sys.argv[7])
    write_bag(bag, clouds, "rclpy", "")
    peer = Peer()
    subscribed = [peer.clouds.get_subscription_count, peer.odometry.get_subscription_count]
    peer.wait("no node answers", lambda: all(count() > 0 for count in subscribed))
    peer.wait("the node is not in the graph", lambda: NODE[1:] in peer.node.get_node_names())
    peer.spin(0.5)
    peer.play(clouds)
    peer.spin(1.5)
    saved = peer.call(Trigger, "save")
    if saved.message != f"durable up to scan {clouds}":
        # check.sh checks whether clouds were lost in transit.
        print(f"rclpy: {saved.message}")
        return
    assert saved.success
    peer.wait("no diagnostics", lambda: "/diagnostics" in peer.last)
    [status] = peer.last["/diagnostics"].status
    assert status.level == b"\0", status
    # Position at the last cloud of peer.py.
    origin = [0.01 * (5 * (clouds - 1) + 0.35), 0.5, 0.0]
    summary = check_outputs(peer, voxtile, folder, origin, radius, max_z)
    print(f"rclpy: {summary}")
    # The map is flushed. check.sh compares this copy with the output of `voxtile build`.
    shutil.copytree(folder, f"{folder}.saved")
    peer.call(Empty, "reset")
    peer.wait("cleared voxels are still published", lambda: peer.last["/octomap_point_cloud_centers"].width == 0)
    rclpy.shutdown()


main()
