"""Zenoh router on a loopback port until it is killed, like `ros2 run rmw_zenoh_cpp rmw_zenohd`.

zenoh_router.py PORT
"""

import signal
import sys

import zenoh

config = zenoh.Config()
config.insert_json5("mode", '"router"')
config.insert_json5("listen/endpoints", f'["tcp/127.0.0.1:{int(sys.argv[1])}"]')
config.insert_json5("scouting/multicast/enabled", "false")
with zenoh.open(config):
    print("listening", flush=True)
    signal.pause()
