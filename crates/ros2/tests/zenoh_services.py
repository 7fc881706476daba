"""Calls every service of a node over Zenoh and checks its tokens. The map is unchanged afterwards.

zenoh_services.py PORT DOMAIN        calls all services, and sends malformed requests
zenoh_services.py PORT DOMAIN again  calls one service after a restart of the router
"""

import struct
import sys
import threading
import time

from ros_messages import OPEN, SERVICE_TYPES, DiagnosticArray, Octomap, Point, service
from service_calls import check
from zenoh_graph import HASHES, Graph, run

SUBSCRIBED = ["/cloud_in", "/tf", "/tf_static"]
PUBLISHED = {
    "/octomap_binary": "octomap_msgs::msg::dds_::Octomap_",
    "/octomap_full": "octomap_msgs::msg::dds_::Octomap_",
    "/octomap_point_cloud_centers": "sensor_msgs::msg::dds_::PointCloud2_",
    "/octomap_point_cloud_changes": "sensor_msgs::msg::dds_::PointCloud2_",
    "/occupied_cells_vis_array": "visualization_msgs::msg::dds_::MarkerArray_",
    "/projected_map": "nav_msgs::msg::dds_::OccupancyGrid_",
    "/local_occupied": "sensor_msgs::msg::dds_::PointCloud2_",
    "/local_inflated": "sensor_msgs::msg::dds_::PointCloud2_",
    "/distance_field": "sensor_msgs::msg::dds_::PointCloud2_",
    "/frontiers": "visualization_msgs::msg::dds_::MarkerArray_",
    "/frontier_goals": "geometry_msgs::msg::dds_::PoseArray_",
    "/diagnostics": "diagnostic_msgs::msg::dds_::DiagnosticArray_",
}


class Topic:
    """Messages of a topic since the last call."""

    def __init__(self, graph, topic, kind, dataclass, **qos):
        self.messages, self.lock = [], threading.Lock()
        graph.subscription(topic, kind, lambda cdr: self.take(dataclass.deserialize(cdr)), **qos)

    def take(self, message):
        with self.lock:
            self.messages.append(message)

    def first(self, seconds=15):
        """Waits for messages and returns them."""
        until = time.time() + seconds
        while not self.messages and time.time() < until:
            time.sleep(0.05)
        return self()

    def __call__(self):
        with self.lock:
            received, self.messages = self.messages, []
        return received


def full_name(name):
    return f"/{name}" if name in OPEN else f"/voxtile_ros2/{name}"


def client(graph, name):
    """Returns a function of the fields of a request, and the key of the service."""
    kind = SERVICE_TYPES[name]
    request, response = service(*kind, {})
    call, key = graph.client(full_name(name), f"{kind[0]}/{kind[1]}")
    return lambda *arguments: response.deserialize(call(bytes(request(*(arguments or [0])).serialize()))), key


def check_tokens(graph):
    """Checks the graph as `ros2 node info` shows it."""
    [node] = [parts for parts in graph.tokens("*/*/*/NN/**") if parts[8] == "voxtile_ros2"]
    assert node[5:] == ["NN", "%", "%", "voxtile_ros2"] and node[3] == node[4] == "0", node
    ends = {}
    for end in ["MP", "MS", "SS"]:
        mine = [parts for parts in graph.tokens(f"*/*/*/{end}/**") if parts[2] == node[2]]
        ends[end] = {parts[9].replace("%", "/"): (parts[10], parts[11], parts[12]) for parts in mine}
        assert len(mine) == len(ends[end]) and all(parts[3] == "0" and len(parts) == 13 for parts in mine)
    assert sorted(ends["MS"]) == sorted(SUBSCRIBED)
    assert {name: kind for name, (kind, _, _) in ends["MP"].items()} == PUBLISHED
    assert sorted(ends["SS"]) == sorted(map(full_name, SERVICE_TYPES))
    cloud = HASHES["sensor_msgs/PointCloud2"]
    assert ends["MS"]["/cloud_in"] == ("sensor_msgs::msg::dds_::PointCloud2_", cloud, "2::,5:,:,:,,")
    assert ends["MS"]["/tf_static"][2] == ":1:,100:,:,:,,"
    assert ends["MP"]["/projected_map"][2] == ":1:,1:,:,:,,"
    assert ends["MP"]["/octomap_point_cloud_changes"][2] == ":1:,10:,:,:,,"
    trigger = HASHES["std_srvs/Trigger"]
    assert ends["SS"]["/voxtile_ros2/save"] == ("std_srvs::srv::dds_::Trigger_", trigger, "::,10:,:,:,,")


def eventually(check, seconds=20):
    """Retries a check, because the graph spreads with a delay."""
    until = time.time() + seconds
    while True:
        try:
            return check()
        except (AssertionError, ValueError):
            if time.time() > until:
                raise
        time.sleep(0.2)


def send_malformed(graph, key):
    """Sends malformed requests. Each gets an error or no response."""
    malformed = b"\0\1\0\0" + struct.pack("<I", 2**32 - 1)
    good = graph.attachment()
    wrong = [(malformed, good), (b"", good), (None, good), (malformed, None), (malformed, b"\xff" * 33)]
    wrong.append((b"\0\7\0\0", good))
    for payload, attachment in wrong:
        replies = list(graph.session.get(key, payload=payload, attachment=attachment, timeout=5.0))
        assert all(reply.ok is None for reply in replies), "a malformed request was answered"
    assert not list(graph.session.get(key, payload=bytes(3 << 20), attachment=good, timeout=5.0))
    # Send more requests at once than the queue holds.
    pending = [graph.session.get(key, payload=malformed, attachment=good, timeout=5.0) for _ in range(300)]
    for replies in pending:
        assert all(reply.ok is None for reply in replies)


def main():
    port, domain = int(sys.argv[1]), int(sys.argv[2])
    graph = Graph(port, domain, "caller")
    graph.wait_for("SS", map(full_name, SERVICE_TYPES))
    calls = {name: client(graph, name) for name in SERVICE_TYPES}
    if sys.argv[3:] == ["again"]:
        print("zenoh: after a restart of the router:", calls["save"][0]().message)
        return
    eventually(lambda: check_tokens(graph))
    octomap = "octomap_msgs/Octomap"
    published = Topic(graph, "/octomap_binary", octomap, Octomap, latched=True, depth=1)
    diagnostics = Topic(graph, "/diagnostics", "diagnostic_msgs/DiagnosticArray", DiagnosticArray)
    [first] = published.first()
    # A late subscriber gets the last message once.
    late = Topic(Graph(port, domain, "late"), "/octomap_binary", octomap, Octomap, latched=True, depth=1)
    [last] = late.first()
    assert bytes(first.serialize()) == bytes(last.serialize())
    time.sleep(1.0)
    assert not published() and not late(), "an unchanged message was sent again"
    functions = {name: call for name, (call, _) in calls.items()}
    check(functions, lambda: send_malformed(graph, calls["snapshot"][1]), published, diagnostics)
    outside = calls["octomap_in_box"][0](Point(0.0, 0.0, 0.0), Point(0.0, 0.0, 0.0), True)
    assert not outside.success and "must be below" in outside.message


if __name__ == "__main__":
    run(main)
