"""Publishes clouds that the node cannot map, each for another reason, and clouds on a topic that it does not read. Then
reads the node's metrics and its log.

monitoring.py send DOMAIN SECONDS
monitoring.py metrics PORT
monitoring.py log FILE
"""

import datetime
import json
import re
import sys
import time
import urllib.request

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


def send(domain, seconds):
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



def parsed(text):
    """Returns the samples of a metrics page: value by name and labels."""
    try:
        from prometheus_client.parser import text_string_to_metric_families
    except ImportError:
        print("skipped: prometheus_client is not installed")
        return None
    samples = {}
    for family in text_string_to_metric_families(text):
        assert family.documentation and family.type in ("counter", "gauge", "summary"), family
        for sample in family.samples:
            assert family.type != "counter" or sample.name.endswith("_total"), sample
            key = (sample.name, *sorted(sample.labels.items()))
            assert key not in samples, key
            samples[key] = sample.value
    return samples


def metrics(port):
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=10) as response:
        assert response.headers["Content-Type"].startswith("text/plain; version=0.0.4"), response.headers
        text = response.read().decode()
    samples = parsed(text)
    if samples is None:
        return
    received = sum(value for key, value in samples.items() if key[0] == "voxtile_clouds_received_total")
    dropped = {key[1][1]: value for key, value in samples.items() if key[0] == "voxtile_clouds_dropped_total"}

    def sample(name):
        return samples[(name,)]

    mapped = sample("voxtile_clouds_mapped_total")
    assert mapped > 20 and sample("voxtile_points_mapped_total") > 1900 * mapped, samples
    assert dropped["no_pose"] > 10 and dropped["malformed"] > 5 and dropped["disk"] == 0, dropped
    assert received == mapped + sum(dropped.values()) + sample("voxtile_clouds_waiting"), samples
    assert sample("voxtile_map_scans") <= mapped and sample("voxtile_map_tiles") > 0, samples
    assert sample("voxtile_flushes_total") > 0 and sample("voxtile_map_disk_bytes") > 0, samples
    assert 0 <= sample("voxtile_last_flush_duration_seconds") < 10, samples
    assert abs(sample("voxtile_last_flush_timestamp_seconds") - time.time()) < 10, samples
    assert sample("voxtile_memory_limit_bytes") == 1 << 30 and sample("voxtile_healthy") == 1, samples
    used = sum(value for key, value in samples.items() if key[0] == "voxtile_memory_used_bytes")
    assert 0 < used < 1 << 30, used
    assert sample("process_resident_memory_bytes") > 1e6, samples
    assert samples[("voxtile_log_messages_total", ("level", "warn"))] > 3, samples
    print(f"{len(samples)} samples")


def log(file):
    """Checks that each line is a JSON object, and that the causes of dropped clouds are named."""
    records = [json.loads(line) for line in open(file)]
    for record in records:
        assert sorted(record) == ["level", "message", "target", "time"], record
        written = datetime.datetime.fromisoformat(record["time"].replace("Z", "+00:00"))
        assert abs(written.timestamp() - time.time()) < 300, record
    warnings = [record["message"] for record in records if record["level"] == "warn"]
    for expected in [
        '^/unknown: no cloud got a pose for . s, \\d+ clouds dropped: no transform from "velodyne" to "map": no '
        "transform names the frame velodyne; frames known: base, lidar, map$",
        "^/registered: no cloud got a pose, 1 cloud dropped: the points are already in the frame map",
        "^/malformed: 1 malformed cloud dropped: .*no field x; fields: y, z, intensity$",
        r"^/late: no cloud got a pose for . s, \d+ clouds dropped: .*the newest is [45]\.\d+ s older than the cloud",
        "^no cloud on /cloud_in for . s: .*/unread has clouds; map them with --cloud /unread$",
    ]:
        found = [message for message in warnings if re.search(expected, message)]
        assert found, (expected, warnings)
    # Each is repeated every 10 s at most.
    assert len(warnings) < 20, warnings


def main():
    if sys.argv[1] == "send":
        send(int(sys.argv[2]), float(sys.argv[3]))
    else:
        {"metrics": metrics, "log": log}[sys.argv[1]](sys.argv[2])


if __name__ == "__main__":
    main()
