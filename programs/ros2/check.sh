#!/usr/bin/env bash
# The node beside an independent peer (Cyclone DDS from PyPI), over loopback: the map of the node and the map that
# `voxtile build` makes of the same messages have one digest, with a hostile peer too; what the node publishes is what
# `voxtile export` writes, and its services do what they say. Without Python or PyPI it says so and passes.
#
# check.sh [friendly] [hostile] [variants] [real]
#
# VOXTILE_ROS2_PYTHON names a Python that has the packages, VOXTILE and VOXTILE_ROS2 name programs that are built.
set -euo pipefail
cd "$(dirname "$0")/../.."

built=${CARGO_TARGET_DIR:-target}/debug
work=$(mktemp -d)
node= listener=
trap 'for one in $node $listener; do kill "$one" 2>/dev/null || true; done; rm -rf "$work"' EXIT

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
program=${VOXTILE_ROS2:-}
if [ -z "$program" ]; then
    cargo build -q --locked -p voxtile-ros2
    program=$built/voxtile-ros2
fi
radius=2.5 max_z=1.0
outputs="--max-range 60 --publish-every 0.2 --publish-radius $radius --projected-radius 30 --occupancy-max-z $max_z"

# Writes down for so many seconds what the node publishes.
listen() {
    "$python" programs/ros2/tests/outputs.py listen $domain "$work/$kind.outputs" "$1" &
    listener=$!
}

# Plays the messages to the node, into the map and the log of this name.
play() {
    "$program" -o "$map" --domain-id $domain --resolution $resolution $outputs >"$work/$kind.log" 2>&1 &
    node=$!
    listen $seconds
    "$python" programs/ros2/tests/peer.py $domain "$work/$kind.bag" $count $kind "$street"
    wait "$listener"
    listener=
    kill -INT "$node"
    wait "$node" || { cat "$work/$kind.log"; exit 1; }
    node=
    grep 'clouds:' "$work/$kind.log" | tail -1 | tee "$work/$kind.counters"
}

# A street of real clouds where they are at hand.
street=${VOXTILE_DATA:-../shared/data}/mulran_riverside02_a
for kind in ${*:-friendly hostile variants real}; do
    map=$work/$kind count=30 resolution=0.1 seconds=12
    if [ $kind = real ]; then
        count=75 resolution=0.2 seconds=20
        [ -d "$street/scans" ] || continue
    fi
    # Clouds are best effort: a machine that is busy enough loses some on the way, which is no fault of the node.
    for attempt in 1 2 3; do
        domain=$((RANDOM % 100 + 100))
        rm -rf "$map" "$work/$kind.bag"
        play
        if grep -q " $count mapped" "$work/$kind.counters"; then break; fi
        sent=$([ $kind = hostile ] && echo 90 || echo $count)
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
    "$voxtile" build "$work/$kind.bag" -o "$map.built" --resolution $resolution --tile-size 10 --max-range 60 >/dev/null
    of_node=$("$voxtile" digest "$map") of_bag=$("$voxtile" digest "$map.built")
    if [ "$of_node" != "$of_bag" ]; then
        echo "$kind: the map of the node is another one: $of_node, not $of_bag"
        cat "$work/$kind.log"
        exit 1
    fi
    "$voxtile" export "$map" -o "$map.csv" --what all >/dev/null
    "$voxtile" export "$map" -o "$map.pgm" --z-max $max_z >/dev/null
    compare() {
        [ $kind = real ] || "$python" programs/ros2/tests/outputs.py compare \
            "$work/$kind.outputs" "$map.csv" "$map.pgm" $count $radius $max_z
    }
    compare
    # The map is there to go on with, and nothing that did not come changes it. Who listens gets it, once.
    "$program" -o "$map" --domain-id $domain --rmw cyclonedds $outputs >"$work/$kind.log" 2>&1 &
    node=$!
    listen 4
    wait "$listener"
    listener=
    compare
    if grep -q '"count": [^1]' "$work/$kind.outputs"; then
        echo "$kind: what did not change was published again"
        exit 1
    fi
    [ $kind = real ] || "$python" programs/ros2/tests/services.py $domain || { cat "$work/$kind.log"; exit 1; }
    kill -TERM "$node"
    wait "$node" || { cat "$work/$kind.log"; exit 1; }
    node=
    grep -q "the map is at scan $count" "$work/$kind.log" || { cat "$work/$kind.log"; exit 1; }
    [ "$("$voxtile" digest "$map")" = "$of_node" ] || { echo "$kind: starting again changes the map"; exit 1; }
    # However points are laid out, and whoever else talks, it is one map.
    [ $kind = friendly ] && of_friend=$of_node
    if [ $kind != real ] && [ "$of_node" != "${of_friend:-$of_node}" ]; then
        echo "$kind: another map than without: $of_node, not $of_friend"
        exit 1
    fi
    echo "$kind: $of_node"
done
