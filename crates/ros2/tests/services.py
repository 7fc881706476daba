"""Calls every service of a node with the map of peer.py over Cyclone DDS. The map is unchanged afterwards.

services.py DOMAIN
"""

import sys
import time
from dataclasses import make_dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import int64, uint32, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from ros_messages import LATCHED, OPEN, RELIABLE, SERVICES, VOLATILE, DiagnosticArray, Octomap
from service_calls import check

GUID = 0x1122334455667788


class Service:
    """Client of one service."""

    def __init__(self, participant, name):
        self.name, self.number = name, 0
        self.request, response = SERVICES[name]
        path = name if name in OPEN else f"voxtile_ros2/{name}"
        qos = Qos(RELIABLE, VOLATILE, Policy.History.KeepLast(10))
        self.writer = DataWriter(participant, Topic(participant, f"rq/{path}Request", self.request), qos=qos)
        self.reader = DataReader(participant, Topic(participant, f"rr/{path}Reply", response), qos=qos)
        self.path = path

    def is_matched(self):
        return self.writer.get_matched_subscriptions() and self.reader.get_matched_publications()

    def __call__(self, *arguments):
        self.number += 1
        self.writer.write(self.request(GUID, self.number, *(arguments or [0])))
        until = time.time() + 10
        while time.time() < until:
            for response in self.reader.take(10):
                if (response.guid, response.number) == (GUID, self.number):
                    return response
            time.sleep(0.005)
        sys.exit(f"{self.name}: no answer")


def send_malformed(domain, service):
    """Sends requests that claim a string of 4 GB."""
    fields = [("guid", uint64), ("number", int64), ("length", uint32)]
    namespace = {"__module__": __name__, "__idl_typename__": service.request.__idl_typename__}
    malformed = make_dataclass("Malformed", fields, bases=(IdlStruct,), namespace=namespace)
    participant = DomainParticipant(domain)
    qos = Qos(RELIABLE, VOLATILE, Policy.History.KeepLast(10))
    writer = DataWriter(participant, Topic(participant, f"rq/{service.path}Request", malformed), qos=qos)
    until = time.time() + 5
    while not writer.get_matched_subscriptions() and time.time() < until:
        time.sleep(0.02)
    for number in range(20):
        writer.write(malformed(1, number, 2**32 - 1))
    time.sleep(0.3)


def main():
    domain = int(sys.argv[1])
    participant = DomainParticipant(domain)
    call = {name: Service(participant, name) for name in SERVICES}
    latched = Qos(RELIABLE, LATCHED, Policy.History.KeepLast(1))
    published = DataReader(participant, Topic(participant, "rt/octomap_binary", Octomap), qos=latched)
    diagnostics = DataReader(participant, Topic(participant, "rt/diagnostics", DiagnosticArray), qos=Qos(RELIABLE))
    until = time.time() + 20
    while not all(service.is_matched() for service in call.values()):
        if time.time() > until:
            sys.exit(f"missing: {[name for name, service in call.items() if not service.is_matched()]}")
        time.sleep(0.02)
    check(
        call,
        lambda: send_malformed(domain, call["snapshot"]),
        lambda: published.take(10),
        lambda: diagnostics.take(100),
    )


main()
