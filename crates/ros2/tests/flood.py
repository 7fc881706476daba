"""Sends a node clouds without transforms, more than its queue holds, and then the transforms of those in the queue.

flood.py DOMAIN CLOUDS PID   prints the growth of the node's peak memory; the numbers of clouds received, dropped,
                               waiting and mapped before the transforms; and how many of the waiting ones were mapped,
                               or had no pose, after the transforms
"""

import sys
import time

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from peer import cloud, header, transform
from ros_messages import BEST, LATCHED, RELIABLE, VOLATILE, DiagnosticArray, PointCloud2, TFMessage


def peak_bytes(pid):
    lines = open(f"/proc/{pid}/status").read().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM:"))


def values(reader, seconds):
    """Returns the last diagnostics within this number of seconds."""
    until, last = time.time() + seconds, None
    while time.time() < until or last is None:
        for message in reader.take(10):
            if hasattr(message, "status"):
                last = {value.key: value.value for value in message.status[0].values}
        time.sleep(0.05)
        if time.time() > until + 20:
            sys.exit("the node publishes no diagnostics")
    return last


def main():
    domain, clouds, pid = map(int, sys.argv[1:])
    participant = DomainParticipant(domain)

    def writer(name, kind, *policies):
        return DataWriter(participant, Topic(participant, name, kind), qos=Qos(*policies))

    still = writer("rt/tf_static", TFMessage, RELIABLE, LATCHED, Policy.History.KeepLast(1))
    moving = writer("rt/tf", TFMessage, RELIABLE, VOLATILE, Policy.History.KeepLast(100))
    flood = writer("rt/cloud_in", PointCloud2, BEST, VOLATILE, Policy.History.KeepLast(5))
    diagnostics = DataReader(participant, Topic(participant, "rt/diagnostics", DiagnosticArray), qos=Qos(RELIABLE))
    until = time.time() + 20
    while not all(one.get_matched_subscriptions() for one in [still, moving, flood]):
        if time.time() > until:
            sys.exit("no node answers")
        time.sleep(0.02)
    still.write(TFMessage([transform(0, "base", "lidar", 0.2, 0.1)]))
    values(diagnostics, 1.5)
    before = peak_bytes(pid)
    plain = cloud(0, 1)
    for number in range(clouds):
        plain.header = header(1_000_000 * number, "lidar")
        flood.write(plain)
        time.sleep(0.001)
    full = values(diagnostics, 2.5)
    grown = peak_bytes(pid) - before
    for tick in range(clouds // 20 + 10):
        stamp_ns = (tick - 5) * 20_000_000
        if stamp_ns >= 0:
            moving.write(TFMessage([transform(stamp_ns, "map", "base", 0.01 * tick, 0.0)]))
        time.sleep(0.002)
    until = time.time() + 120
    while int((last := values(diagnostics, 1.5))["clouds_waiting"]) > 0:
        if time.time() > until:
            sys.exit(f"clouds are still waiting: {last}")
    counts = [full[key] for key in ["clouds_received", "dropped_behind", "clouds_waiting", "clouds_mapped"]]
    print(grown, *counts, *(last[key] for key in ["clouds_mapped", "dropped_without_pose"]))


main()
