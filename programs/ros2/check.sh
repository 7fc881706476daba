#!/usr/bin/env bash
# The node beside an independent peer (Cyclone DDS from PyPI), over loopback: the map of the node and the map that
# `voxtile build` makes of the same messages have one digest, with a hostile peer too. Without Python or PyPI it says
# so and passes. VOXTILE_ROS2_PYTHON names a Python that has the packages.
set -euo pipefail
cd "$(dirname "$0")/../.."

work=$(mktemp -d)
node=
trap '[ -z "$node" ] || kill "$node" 2>/dev/null || true; rm -rf "$work"' EXIT

python=${VOXTILE_ROS2_PYTHON:-}
if [ -z "$python" ]; then
    python=$work/venv/bin/python
    if ! { python3 -m venv "$work/venv" && "$python" -m pip -q install cyclonedds==11.0.1 rosbags numpy; }; then
        echo "skipped: no Python with cyclonedds and rosbags; name one with VOXTILE_ROS2_PYTHON"
        exit 0
    fi
fi

voxtile=${VOXTILE:-}
if [ -z "$voxtile" ]; then
    cargo build -q
    voxtile=target/debug/voxtile
fi
cargo build -q -p voxtile-ros2

for kind in friendly hostile; do
    domain=$((RANDOM % 100 + 100))
    map=$work/$kind
    target/debug/voxtile-ros2 -o "$map" --domain-id $domain --resolution 0.1 >"$work/$kind.log" 2>&1 &
    node=$!
    "$python" programs/ros2/tests/peer.py $domain "$work/$kind.bag" 30 $([ $kind = hostile ] && echo hostile)
    kill -INT "$node"
    wait "$node" || { cat "$work/$kind.log"; exit 1; }
    node=
    grep 'clouds:' "$work/$kind.log" | tail -1
    "$voxtile" build "$work/$kind.bag" -o "$map.built" --resolution 0.1 --tile-size 10 >/dev/null
    of_node=$("$voxtile" digest "$map") of_bag=$("$voxtile" digest "$map.built")
    if [ "$of_node" != "$of_bag" ]; then
        echo "$kind: the map of the node is another one: $of_node, not $of_bag"
        cat "$work/$kind.log"
        exit 1
    fi
    # The map is there to go on with, and nothing that did not come changes it.
    target/debug/voxtile-ros2 -o "$map" --domain-id $domain >"$work/$kind.log" 2>&1 &
    node=$!
    sleep 2
    kill -TERM "$node"
    wait "$node" || { cat "$work/$kind.log"; exit 1; }
    node=
    grep -q 'the map is at scan 30' "$work/$kind.log" || { cat "$work/$kind.log"; exit 1; }
    [ "$("$voxtile" digest "$map")" = "$of_node" ] || { echo "$kind: starting again changes the map"; exit 1; }
    echo "$kind: $of_node"
done
