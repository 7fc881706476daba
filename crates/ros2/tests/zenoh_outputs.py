"""Receives the node's outputs over Zenoh with an independent peer; outputs.py compares them.

zenoh_outputs.py PORT DOMAIN FILE SECONDS   writes the last message and the number of messages of each topic after
                                            SECONDS or at SIGTERM
"""

import functools
import signal
import sys
import threading
import time
from collections import Counter

from outputs import CHANGES, TYPES, Taken
from zenoh_graph import Graph, run


class Waiting:
    """Messages that are not decoded yet: the last of each topic, and all changes.

    Messages arrive faster than Python decodes them on a busy machine.
    """

    def __init__(self):
        self.lock, self.messages, self.counts = threading.Lock(), {}, Counter()

    def put(self, name, kind, cdr):
        with self.lock:
            self.counts[name] += 1
            before = self.messages.get(name, []) if name == CHANGES else []
            self.messages[name] = [*before, (kind, cdr)]

    def take(self):
        with self.lock:
            taken, self.messages = self.messages, {}
        return [(name, *message) for name, messages in taken.items() for message in messages]


def main():
    port, domain, file, seconds = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3], float(sys.argv[4])
    ended = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: ended.set())
    graph, taken, waiting = Graph(port, domain, "listener"), Taken(), Waiting()

    def decode():
        for name, kind, cdr in waiting.take():
            try:
                taken.take(name, kind.deserialize(cdr), cdr)
            except Exception as error:
                sys.exit(f"wrong message: {name}: {error!r}")

    for name, (kind, ros_name) in TYPES.items():
        depth = 100 if name == CHANGES else 1
        put = functools.partial(waiting.put, name, kind)
        graph.subscription("/" + name, ros_name.replace("/msg/", "/"), put, latched=True, depth=depth)
    until = time.monotonic() + seconds
    while not ended.wait(0.05) and time.monotonic() < until:
        decode()
    decode()
    for name, count in waiting.counts.items():
        taken.got[name]["count"] = count
    taken.write(file)


if __name__ == "__main__":
    run(main)
