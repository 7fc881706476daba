"""Tests the node with the independent zenoh_ros2_sdk: its topics, and two services whose hashes the SDK computes.

zenoh_sdk.py PORT DOMAIN   passes with a message if the package is missing
"""

import os
import sys
import time

try:
    from zenoh_ros2_sdk import ROS2ServiceClient
    from zenoh_ros2_sdk.discovery import get_topic_names_and_types
    from zenoh_ros2_sdk.qos import QosDurability, QosProfile, QosReliability
    from zenoh_ros2_sdk.session import ZenohSession
except ImportError as error:
    print(f"skipped: no zenoh_ros2_sdk: {error}")
    sys.exit(0)

OUTCOME = "bool success\nstring message\n"


def retried(query, is_complete, seconds=20):
    """Retries until the answer is complete: a new session may not know the tokens and services of others yet."""
    until = time.time() + seconds
    while True:
        answer = query()
        if is_complete(answer) or time.time() > until:
            return answer
        time.sleep(0.1)


def main():
    port, domain = int(sys.argv[1]), int(sys.argv[2])

    def client(name, kind, request):
        return ROS2ServiceClient(name, kind, request, OUTCOME, domain_id=domain, router_port=port)

    def is_answer(response):
        return response is not None

    save = client("/voxtile_ros2/save", "std_srvs/srv/Trigger", "# nothing\n")
    saved = retried(save.call, is_answer)
    assert saved is not None and saved.success and saved.message.startswith("durable"), saved
    revert = client("/voxtile_ros2/revert", "voxtile_msgs/srv/Snapshot", "string name\n")
    named = retried(lambda: revert.call(name="unknown"), is_answer)
    assert named is not None and not named.success and named.message, named
    wanted = {"/octomap_binary": ["octomap_msgs/msg/Octomap"], "/cloud_in": ["sensor_msgs/msg/PointCloud2"]}
    topics = retried(
        lambda: dict(get_topic_names_and_types(domain, router_port=port, timeout=5.0)),
        lambda topics: wanted.keys() <= topics.keys(),
    )
    assert wanted.items() <= topics.items(), topics
    session = ZenohSession.get_instance("127.0.0.1", port)
    token = f"@ros2_lv/{domain}/*/*/*/MP/*/*/voxtile_ros2/%projected_map/**"
    replies = retried(lambda: list(session.liveliness.get(token, timeout=5.0)), bool)
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
# Exit at once, because its sessions keep threads.
sys.stdout.flush()
os._exit(status)
