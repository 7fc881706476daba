"""The node as zenoh_ros2_sdk sees it, which others wrote: its topics, and two services with hashes that it computes.

zenoh_sdk.py PORT DOMAIN   without the package it says so and passes
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


def asked_again(question, is_whole, seconds=20):
    """The answer once it is whole: a session that was just opened may not know of others' tokens and services yet."""
    until = time.time() + seconds
    while True:
        answer = question()
        if is_whole(answer) or time.time() > until:
            return answer
        time.sleep(0.1)


def main():
    port, domain = int(sys.argv[1]), int(sys.argv[2])

    def client(name, kind, request):
        return ROS2ServiceClient(name, kind, request, OUTCOME, domain_id=domain, router_port=port)

    def is_answer(response):
        return response is not None

    save = client("/voxtile_ros2/save", "std_srvs/srv/Trigger", "# nothing\n")
    saved = asked_again(save.call, is_answer)
    assert saved is not None and saved.success and saved.message.startswith("durable"), saved
    revert = client("/voxtile_ros2/revert", "voxtile_msgs/srv/Snapshot", "string name\n")
    named = asked_again(lambda: revert.call(name="of nobody"), is_answer)
    assert named is not None and not named.success and named.message, named
    wanted = {"/octomap_binary": ["octomap_msgs/msg/Octomap"], "/cloud_in": ["sensor_msgs/msg/PointCloud2"]}
    topics = asked_again(
        lambda: dict(get_topic_names_and_types(domain, router_port=port, timeout=5.0)),
        lambda topics: wanted.keys() <= topics.keys(),
    )
    assert wanted.items() <= topics.items(), topics
    session = ZenohSession.get_instance("127.0.0.1", port)
    token = f"@ros2_lv/{domain}/*/*/*/MP/*/*/voxtile_ros2/%projected_map/**"
    replies = asked_again(lambda: list(session.liveliness.get(token, timeout=5.0)), bool)
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
