"""ROS 2 node over Zenoh, written from the design of rmw_zenoh_cpp (its docs/design.md), independent of the node."""

import itertools
import os
import struct
import sys
import time

import zenoh
import zenoh.ext
from definitions import hashes, typestore

HASHES = hashes(typestore())
ANSWER_S = 15.0
SESSIONS = []


def run(main):
    """Runs a program and always closes the sessions, whose threads would keep the process running."""
    try:
        main()
    finally:
        for session in SESSIONS:
            session.close()


def dds_name(kind, folder):
    package, own = kind.split("/")
    return f"{package}::{folder}::dds_::{own}_"


def qos_text(reliable, latched, depth):
    return f"{'' if reliable else 2}:{1 if latched else ''}:,{depth}:,:,:,,"


class Graph:
    """Session that is connected to a router, with one node."""

    def __init__(self, port, domain, name="peer"):
        config = zenoh.Config()
        config.insert_json5("mode", '"peer"')
        config.insert_json5("connect/endpoints", f'["tcp/127.0.0.1:{port}"]')
        config.insert_json5("listen/endpoints", '["tcp/127.0.0.1:0"]')
        config.insert_json5("scouting/multicast/enabled", "false")
        config.insert_json5("timestamping/enabled", "true")
        self.session = zenoh.open(config)
        SESSIONS.append(self.session)
        self.domain, self.name, self.gid = domain, name, os.urandom(16)
        self.entities, self.numbers, self.kept = itertools.count(), itertools.count(1), []
        self.declare(f"{self.start()}/{next(self.entities)}/NN/%/%/{name}")

    def start(self):
        return f"@ros2_lv/{self.domain}/{self.session.info.zid()}/0"

    def declare(self, token):
        self.kept.append(self.session.liveliness().declare_token(token))

    def announce(self, end, topic, kind, qos, folder="msg"):
        """Announces an endpoint of a topic or service and returns its key."""
        typed = f"{dds_name(kind, folder)}/{HASHES[kind]}"
        mangled = topic.replace("/", "%")
        self.declare(f"{self.start()}/{next(self.entities)}/{end}/%/%/{self.name}/{mangled}/{typed}/{qos}")
        return f"{self.domain}/{topic.strip('/')}/{typed}"

    def attachment(self):
        return struct.pack("<qqB", next(self.numbers), time.time_ns(), 16) + self.gid

    def publisher(self, topic, kind, reliable=True, latched=False, depth=10):
        """Returns a function that publishes CDR bytes."""
        key = self.announce("MP", topic, kind, qos_text(reliable, latched, depth))
        if latched:
            options = {"heartbeat": None, "sporadic_heartbeat": 0.5}
            publisher = zenoh.ext.declare_advanced_publisher(
                self.session,
                key,
                cache=zenoh.ext.CacheConfig(depth),
                sample_miss_detection=zenoh.ext.MissDetectionConfig(**options),
                publisher_detection=True,
            )
        else:
            # Block instead of dropping messages, because tests count them.
            publisher = self.session.declare_publisher(key, congestion_control=zenoh.CongestionControl.BLOCK)
        self.kept.append(publisher)
        return lambda cdr: publisher.put(cdr, attachment=self.attachment())

    def subscription(self, topic, kind, take, reliable=True, latched=False, depth=10):
        """Calls a function with the bytes of each message."""
        key = self.announce("MS", topic, kind, qos_text(reliable, latched, depth))
        seen = {}

        def on_sample(sample):
            number, stamp_ns, length, gid = struct.unpack("<qqB16s", sample.attachment.to_bytes())
            assert length == 16 and abs(time.time_ns() - stamp_ns) < 60 * 10**9
            assert number > seen.get(gid, 0), f"{topic}: {number} after {seen}"
            seen[gid] = number
            take(sample.payload.to_bytes())

        if latched:
            subscriber = zenoh.ext.declare_advanced_subscriber(
                self.session,
                key,
                on_sample,
                history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=depth),
                recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
                subscriber_detection=True,
            )
        else:
            subscriber = self.session.declare_subscriber(key, on_sample)
        self.kept.append(subscriber)

    def client(self, service, kind):
        """Returns a function that sends the bytes of a request and returns those of the response, and the key."""
        key = self.announce("SC", service, kind, qos_text(True, False, 10), "srv")

        def call(cdr):
            attachment, replies = self.attachment(), []
            until = time.time() + ANSWER_S
            # Tokens arrive before the route to the service is known. Until then, Zenoh returns immediately, without a
            # reply.
            while not replies and time.time() < until:
                replies = list(self.session.get(key, payload=cdr, attachment=attachment, timeout=ANSWER_S))
            if len(replies) != 1 or replies[0].ok is None:
                sys.exit(f"{service}: {[(one.ok, one.err and one.err.payload.to_string()) for one in replies]}")
            number, _, length, gid = struct.unpack("<qqB16s", replies[0].ok.attachment.to_bytes())
            assert (number, length, gid) == (struct.unpack_from("<q", attachment)[0], 16, self.gid)
            return replies[0].ok.payload.to_bytes()

        return call, key

    def tokens(self, pattern):
        """Returns the current tokens of other sessions, split into their parts."""
        replies = self.session.liveliness().get(f"@ros2_lv/{self.domain}/{pattern}", timeout=5.0)
        found = [str(reply.ok.key_expr).split("/") for reply in replies if reply.ok is not None]
        return [parts for parts in found if parts[2] != str(self.session.info.zid())]

    def wait_for(self, end, names, seconds=20):
        """Waits for the endpoints of these topics or services."""
        until = time.time() + seconds
        while True:
            found = {parts[9].replace("%", "/") for parts in self.tokens(f"*/*/*/{end}/**")}
            if set(names) <= found:
                return
            if time.time() > until:
                sys.exit(f"missing: {sorted(set(names) - found)}")
            time.sleep(0.1)
