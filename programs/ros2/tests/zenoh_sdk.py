"""The node as zenoh_ros2_sdk sees it, which others wrote: its topics, and two services with hashes that it computes.

zenoh_sdk.py PORT DOMAIN   without the package it says so and passes
"""

import os
import sys

try:
    from zenoh_ros2_sdk import ROS2ServiceClient
    from zenoh_ros2_sdk.discovery import get_topic_names_and_types
    from zenoh_ros2_sdk.qos import QosDurability, QosProfile, QosReliability
    from zenoh_ros2_sdk.session import ZenohSession
except ImportError as error:
    print(f"skipped: no zenoh_ros2_sdk: {error}")
    sys.exit(0)

OUTCOME = "bool success\nstring message\n"


def main():
    port, domain = int(sys.argv[1]), int(sys.argv[2])

    def client(name, kind, request):
        return ROS2ServiceClient(name, kind, request, OUTCOME, domain_id=domain, router_port=port)

    saved = client("/voxtile_ros2/save", "std_srvs/srv/Trigger", "# nothing\n").call()
    assert saved is not None and saved.success and saved.message.startswith("durable"), saved
    named = client("/voxtile_ros2/revert", "voxtile_msgs/srv/Snapshot", "string name\n").call(name="of nobody")
    assert named is not None and not named.success and named.message, named
    topics = dict(get_topic_names_and_types(domain, router_port=port, timeout=5.0))
    assert topics["/octomap_binary"] == ["octomap_msgs/msg/Octomap"], topics
    assert topics["/cloud_in"] == ["sensor_msgs/msg/PointCloud2"], topics
    session = ZenohSession.get_instance("127.0.0.1", port)
    replies = session.liveliness.get(f"@ros2_lv/{domain}/*/*/*/MP/*/*/voxtile_ros2/%projected_map/**", timeout=5.0)
    [qos] = [QosProfile.decode(str(reply.ok.key_expr).split("/")[-1]) for reply in replies]
    wanted = QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, 1
    assert (qos.reliability, qos.durability, qos.history_depth) == wanted, qos
    print(f"zenoh_ros2_sdk: {len(topics)} topics, {saved.message}, refused: {named.message}")


try:
    main()
    status = 0
except BaseException as error:
    print(f"zenoh_sdk.py: {error!r}", file=sys.stderr)
    status = 1
# Its sessions keep threads.
sys.stdout.flush()
os._exit(status)
