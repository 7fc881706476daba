"""An independent ROS 2 peer over Zenoh: writes a bag of clouds and tf, and publishes the same messages.

zenoh_peer.py PORT DOMAIN BAG CLOUDS friendly|hostile

hostile: also sends malformed clouds, random bytes, more than the queue holds, messages without attachment, wrong types
and thousands of tokens.
"""

import os
import pathlib
import sys
import time

import zenoh
from peer import START_S, TYPES, cloud, loops, messages, topics_of, write_bag
from zenoh_graph import Graph, run
from zenoh_services import client


def hostilities(graph, key):
    """Sends messages and tokens that no correct node sends."""
    garbage = [b"", b"\0", b"\0\1\0\0", b"\0\1\0\0" + b"\xff" * 64, os.urandom(5000), b"\0\7\0\0" + bytes(100)]
    for one in garbage:
        graph.session.put(key, one)
        graph.session.put(key, one, attachment=b"\xff" * 40)
    block = zenoh.CongestionControl.BLOCK
    graph.session.put(key, bytes(17 << 20), attachment=graph.attachment(), congestion_control=block)
    graph.session.put(key.replace("PointCloud2", "Image"), bytes(1000))
    graph.session.put(key.rsplit("/", 1)[0] + "/RIHS01_" + "0" * 64, bytes(1000))
    graph.session.delete(key)
    for number in range(3000):
        parts = f"MS/%/%/flood/%octomap_binary/octomap_msgs::msg::dds_::Octomap_/{number}/::,1:,:,:,,"
        graph.declare(f"{graph.start()}/{number + 100}/{parts}")


def main():
    port, domain, bag, clouds = int(sys.argv[1]), int(sys.argv[2]), pathlib.Path(sys.argv[3]), int(sys.argv[4])
    is_hostile = sys.argv[5] == "hostile"
    write_bag(bag, clouds, "friendly", "")
    graph = Graph(port, domain)
    publishers = {}
    for name in topics_of("friendly"):
        kind = TYPES[name].replace("/msg/", "/")
        publishers[name] = graph.publisher(name, kind, name != "/cloud_in", name == "/tf_static")
    coming = messages(clouds, "friendly", "")
    name, mounts = next(coming)
    publishers[name](bytes(mounts.serialize()))
    print("published", flush=True)
    graph.wait_for("MS", publishers)
    key = None
    time.sleep(0.5)
    for number, (name, message) in enumerate(coming):
        if is_hostile and number == 20:
            key = graph.announce("MP", "/cloud_in", "sensor_msgs/PointCloud2", "2::,5:,:,:,,")
            # Let the queued messages be taken first: the following ones displace older ones.
            time.sleep(0.3)
            hostilities(graph, key)
            # The router drops messages for a node that is busy for seconds. This call returns after all were taken.
            get_octomap, _ = client(graph, "octomap_binary")
            get_octomap()
        if is_hostile and name == "/cloud_in" and number > 20:
            malformed = cloud(0, 1)
            malformed.header.stamp = message.header.stamp
            malformed.height = malformed.width = malformed.row_step = 2**32 - 1
            publishers[name](bytes(malformed.serialize()))
            publishers["/tf"](bytes(malformed.serialize()))
            stamp = message.header.stamp
            wrong = loops((stamp.sec - START_S) * 10**9 + stamp.nanosec)
            publishers["/tf"](bytes(wrong.serialize()))
        publishers[name](bytes(message.serialize()))
        time.sleep(0.02)
    time.sleep(1.5)


if __name__ == "__main__":
    run(main)
