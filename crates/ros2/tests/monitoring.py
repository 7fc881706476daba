"""Publishes clouds that the node cannot map, each for another reason, and clouds on a topic that it does not read.

monitoring.py DOMAIN SECONDS
"""

import sys
import time

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from peer import cloud, header, transform
from ros_messages import BEST, LATCHED, RELIABLE, VOLATILE, PointCloud2, TFMessage


def in_frame(frame, stamp_ns, number):
    message = cloud(stamp_ns, number)
    message.header = header(stamp_ns, frame)
    return message


def without_x(stamp_ns, number):
    message = in_frame("lidar", stamp_ns, number)
    message.fields = [field for field in message.fields if field.name != "x"]
    return message


def main():
    domain, seconds = int(sys.argv[1]), float(sys.argv[2])
    participant = DomainParticipant(domain)

    def writer(name, kind, *policies):
        return DataWriter(participant, Topic(participant, "rt" + name, kind), qos=Qos(*policies))

    clouds = ["/mapped", "/unknown", "/registered", "/malformed", "/late", "/unread"]
    writers = {name: writer(name, PointCloud2, BEST, VOLATILE, Policy.History.KeepLast(5)) for name in clouds}
    static = writer("/tf_static", TFMessage, RELIABLE, LATCHED, Policy.History.KeepLast(1))
    tf = writer("/tf", TFMessage, RELIABLE, VOLATILE, Policy.History.KeepLast(100))
    until = time.time() + 20
    while not all(writers[name].get_matched_subscriptions() for name in clouds[:-1]):
        if time.time() > until:
            sys.exit("no node answers")
        time.sleep(0.02)
    time.sleep(0.5)
    static.write(TFMessage([transform(0, "base", "lidar", 0.2, 0.0)]))
    for tick in range(int(10 * seconds)):
        stamp_ns = tick * 100_000_000
        tf.write(TFMessage([transform(stamp_ns, "map", "base", 0.01 * tick, 0.0)]))
        before_ns = stamp_ns - 50_000_000
        if tick > 0:
            writers["/mapped"].write(in_frame("lidar", before_ns, tick))
        if tick % 5 == 0:
            writers["/unknown"].write(in_frame("velodyne", before_ns, tick))
            writers["/registered"].write(in_frame("map", before_ns, tick))
            writers["/malformed"].write(without_x(before_ns, tick))
            # Its clock is 5 s ahead of the clock of the transforms.
            writers["/late"].write(in_frame("lidar", stamp_ns + 5_000_000_000, tick))
            writers["/unread"].write(in_frame("lidar", before_ns, tick))
        time.sleep(0.1)


if __name__ == "__main__":
    main()
