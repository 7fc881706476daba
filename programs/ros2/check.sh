#!/usr/bin/env bash
# The node beside an independent peer (Cyclone DDS from PyPI), over loopback: the map of the node and the map that
# `voxtile build` makes of the same messages have one digest, with a hostile peer too. Without Python or PyPI it says
# so and passes. VOXTILE_ROS2_PYTHON names a Python that has the packages.
set -euo pipefail
cd "$(dirname "$0")/../.."

built=${CARGO_TARGET_DIR:-target}/debug
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
    cargo build -q --locked
    voxtile=$built/voxtile
fi
cargo build -q --locked -p voxtile-ros2

# Plays the messages to the node, into the map and the log of this name.
play() {
    "$built/voxtile-ros2" -o "$map" --domain-id $domain --resolution 0.1 >"$work/$kind.log" 2>&1 &
    node=$!
    "$python" programs/ros2/tests/peer.py $domain "$work/$kind.bag" 30 $([ $kind = hostile ] && echo hostile)
    kill -INT "$node"
    wait "$node" || { cat "$work/$kind.log"; exit 1; }
    node=
    grep 'clouds:' "$work/$kind.log" | tail -1 | tee "$work/$kind.counters"
}

for kind in friendly hostile; do
    map=$work/$kind
    # Clouds are best effort: a machine that is busy enough loses some on the way, which is no fault of the node.
    for attempt in 1 2 3; do
        domain=$((RANDOM % 100 + 100))
        rm -rf "$map" "$work/$kind.bag"
        play
        if grep -q ' 30 mapped' "$work/$kind.counters"; then break; fi
        sent=$([ $kind = hostile ] && echo 90 || echo 30)
        if grep -q "clouds: $sent received" "$work/$kind.counters"; then
            echo "$kind: all clouds came, and not all were mapped"
            cat "$work/$kind.log"
            exit 1
        fi
        if [ $attempt = 3 ]; then
            echo "skipped: this machine has lost clouds on the way, three times"
            exit 0
        fi
    done
    "$voxtile" build "$work/$kind.bag" -o "$map.built" --resolution 0.1 --tile-size 10 >/dev/null
    of_node=$("$voxtile" digest "$map") of_bag=$("$voxtile" digest "$map.built")
    if [ "$of_node" != "$of_bag" ]; then
        echo "$kind: the map of the node is another one: $of_node, not $of_bag"
        cat "$work/$kind.log"
        exit 1
    fi
    # The map is there to go on with, and nothing that did not come changes it.
    "$built/voxtile-ros2" -o "$map" --domain-id $domain >"$work/$kind.log" 2>&1 &
    node=$!
    sleep 2
    kill -TERM "$node"
    wait "$node" || { cat "$work/$kind.log"; exit 1; }
    node=
    grep -q 'the map is at scan 30' "$work/$kind.log" || { cat "$work/$kind.log"; exit 1; }
    [ "$("$voxtile" digest "$map")" = "$of_node" ] || { echo "$kind: starting again changes the map"; exit 1; }
    echo "$kind: $of_node"
done
