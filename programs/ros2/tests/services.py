"""Calls every service of a node that has a map of peer.py, as Cyclone DDS does; the map is as before then.

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
from octrees import binary_leaves, full_leaves, octets, voxels_of
from ros_messages import LATCHED, RELIABLE, SERVICES, VOLATILE, DiagnosticArray, Octomap, Point, Vector3

GUID = 0x1122334455667788
EVERYWHERE = Point(-1e3, -1e3, -1e3), Point(1e3, 1e3, 1e3)
OPEN = ["octomap_binary", "octomap_full"]


class Service:
    """A client of one service."""

    def __init__(self, participant, name):
        self.name, self.number = name, 0
        self.request, response = SERVICES[name]
        path = name if name in OPEN else f"voxtile_ros2/{name}"
        qos = Qos(RELIABLE, VOLATILE, Policy.History.KeepLast(10))
        self.writer = DataWriter(participant, Topic(participant, f"rq/{path}Request", self.request), qos=qos)
        self.reader = DataReader(participant, Topic(participant, f"rr/{path}Reply", response), qos=qos)
        self.path = path

    def is_there(self):
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


def lie(domain, service):
    """A request for a text of 4 GB that is not there."""
    fields = [("guid", uint64), ("number", int64), ("length", uint32)]
    namespace = {"__module__": __name__, "__idl_typename__": service.request.__idl_typename__}
    liar = make_dataclass("Liar", fields, bases=(IdlStruct,), namespace=namespace)
    participant = DomainParticipant(domain)
    qos = Qos(RELIABLE, VOLATILE, Policy.History.KeepLast(10))
    writer = DataWriter(participant, Topic(participant, f"rq/{service.path}Request", liar), qos=qos)
    until = time.time() + 5
    while not writer.get_matched_subscriptions() and time.time() < until:
        time.sleep(0.02)
    for number in range(20):
        writer.write(liar(1, number, 2**32 - 1))
    time.sleep(0.3)


def main():
    domain = int(sys.argv[1])
    participant = DomainParticipant(domain)
    call = {name: Service(participant, name) for name in SERVICES}
    latched = Qos(RELIABLE, LATCHED, Policy.History.KeepLast(1))
    published = DataReader(participant, Topic(participant, "rt/octomap_binary", Octomap), qos=latched)
    diagnostics = DataReader(participant, Topic(participant, "rt/diagnostics", DiagnosticArray), qos=Qos(RELIABLE))
    until = time.time() + 20
    while not all(service.is_there() for service in call.values()):
        if time.time() > until:
            sys.exit(f"not there: {[name for name, service in call.items() if not service.is_there()]}")
        time.sleep(0.02)

    def whole(binary=True):
        response = call["octomap_in_box"](*EVERYWHERE, binary)
        assert response.success, response.message
        data = octets(response.map.data)
        return voxels_of((binary_leaves if binary else full_leaves)(data)) if data else {}

    saved = call["save"]()
    assert saved.success and saved.message == "durable up to scan 30", saved
    before, before_full = whole(), whole(False)
    assert len(before) > 10000 and set(before) == set(before_full)
    assert before == {voxel: log_odds >= 0 for voxel, log_odds in before_full.items()}
    resolution = call["octomap_full"]().map.resolution
    for name, leaves in [("octomap_binary", binary_leaves), ("octomap_full", full_leaves)]:
        around = voxels_of(leaves(octets(call[name]().map.data)))
        assert 0 < len(around) < len(before) and set(around) < set(before)

    origin = Point(2.0, 0.7, 0.05)
    hit = call["cast_ray"](origin, Vector3(1.0, 0.0, 0.0), 0.0, False)
    assert hit.success and hit.hit and hit.distance > 1 and hit.probability > 0.5, hit
    place = [hit.center.x, hit.center.y, hit.center.z]
    assert before[tuple(round(at / resolution - 0.5) for at in place)]
    assert not call["cast_ray"](origin, Vector3(1.0, 0.0, 0.0), hit.distance - 0.2, False).hit
    touched = call["check_collision"](origin, hit.center, 0.05, False)
    assert touched.success and touched.hit
    assert not call["check_collision"](origin, origin, 0.2, False).hit
    for wrong in [Vector3(0.0, 0.0, 0.0), Vector3(float("nan"), 0.0, 0.0)]:
        answer = call["cast_ray"](origin, wrong, 0.0, False)
        assert not answer.success and answer.message

    assert call["snapshot"]("before").success
    assert not call["snapshot"]("before").success
    assert not call["snapshot"]("../out").success
    assert not call["revert"]("never").success
    lie(domain, call["snapshot"])

    corner = Point(-1e3, -1e3, 0.5)
    call["clear_bbox"](corner, EVERYWHERE[1])
    below = {voxel: occupied for voxel, occupied in before.items() if voxel[2] < 5}
    assert whole() == below and 0 < len(below) < len(before)
    # A box that is none changes nothing.
    call["clear_bbox"](EVERYWHERE[1], corner)
    assert whole() == below
    call["reset"]()
    assert whole() == {}
    time.sleep(1.0)
    last = published.take(10)[-1]
    assert len(last.data) == 0, "what was cleared is still published"
    reverted = call["revert"]("before")
    assert reverted.success, reverted
    assert whole(False) == before_full
    time.sleep(1.0)
    assert len(published.take(10)[-1].data) > 0, "what came back is not published"

    [status] = diagnostics.take(100)[-1].status
    values = {value.key: value.value for value in status.values}
    assert (status.level, values["scan_number"], values["unflushed_scans"]) == (0, "30", "0"), status
    assert int(values["memory_bytes"]) > 0 and int(values["disk_bytes"]) > 0 and float(values["flush_age_s"]) < 3
    print(f"services: {len(before)} voxels, {len(below)} below, hit at {hit.distance:.2f} m")


main()
