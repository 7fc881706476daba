"""Receives the node's outputs over Zenoh with an independent peer; outputs.py compares them.

zenoh_outputs.py PORT DOMAIN FILE SECONDS   writes the last message and the number of messages of each topic after
                                            SECONDS or at SIGTERM
"""

import functools
import signal
import sys
import threading

from outputs import CHANGES, TYPES, Taken
from zenoh_graph import Graph, run


def main():
    port, domain, file, seconds = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3], float(sys.argv[4])
    ended = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: ended.set())
    graph, taken, lock, wrong = Graph(port, domain, "listener"), Taken(), threading.Lock(), []

    def take(name, kind, cdr):
        with lock:
            try:
                taken.take(name, kind.deserialize(cdr), cdr)
            except Exception as error:
                wrong.append(f"{name}: {error!r}")

    for name, (kind, ros_name) in TYPES.items():
        depth = 100 if name == CHANGES else 1
        own_take = functools.partial(take, name, kind)
        graph.subscription("/" + name, ros_name.replace("/msg/", "/"), own_take, latched=True, depth=depth)
    ended.wait(seconds)
    with lock:
        if wrong:
            sys.exit(f"wrong messages: {wrong}")
        taken.write(file)


if __name__ == "__main__":
    run(main)
