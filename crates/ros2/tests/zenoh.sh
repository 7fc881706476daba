#!/usr/bin/env bash
# Tests the node over Zenoh with an independent peer (eclipse-zenoh from PyPI) and a router, over loopback: maps,
# outputs and services as in check.sh, and tokens, late subscribers, malformed messages and a restart of the router.
#
# zenoh.sh WORK_FOLDER   run by check.sh, which exports `python`, `voxtile`, `program`, `outputs` and more variables
set -euo pipefail
cd "$(dirname "$0")"

work=$1/zenoh
mkdir "$work"
port=$((RANDOM % 10000 + 20000)) domain=$((RANDOM % 100 + 100))
router= node= listener= peer= of_friend=
trap 'for one in $node $listener $peer $router; do kill "$one" 2>/dev/null || true; done' EXIT

fail() {
    echo "zenoh: $*"
    cat "$work"/*.log
    exit 1
}

start_router() {
    "$python" zenoh_router.py $port >"$work/router.out" 2>&1 &
    router=$!
    for _ in $(seq 200); do
        grep -q listening "$work/router.out" && return
        sleep 0.1
    done
    fail "no router"
}

end_router() {
    kill $router
    wait $router || true
    router=
}

# Starts the node with a map. The long wait for transforms covers the time that a hostile peer takes.
start() {
    # shellcheck disable=SC2086
    "$program" -o "$1" --transport zenoh --zenoh-router tcp/127.0.0.1:$port --domain-id $domain --resolution 0.1 \
        --memory 128MiB --transform-wait 60 $outputs >"$1.log" 2>&1 &
    node=$!
}

end() {
    kill "-$1" $node
    wait $node || fail "the node failed"
    node=
}

compare() {
    "$python" outputs.py compare "$work/$1.outputs" "$work/$1.csv" "$work/$1.pgm" 30 $radius $max_z $2 $inflation_range
}

declare -A peak_kib
"$python" type_hashes.py
for kind in friendly hostile; do
    map=$work/$kind
    if [ $kind = friendly ]; then
        # Start the node first: it must retry until there is a router.
        start "$map"
        start_router
    else
        start_router
    fi
    "$python" zenoh_peer.py $port $domain "$map.bag" 30 $kind >"$map.peer" &
    peer=$!
    if [ $kind = hostile ]; then
        # Start the node after the static transforms were sent: it must receive them.
        for _ in $(seq 200); do
            grep -q published "$map.peer" && break
            sleep 0.1
        done
        start "$map"
    fi
    "$python" zenoh_outputs.py $port $domain "$map.outputs" 120 &
    listener=$!
    wait $peer || fail "the peer failed"
    peer=
    sleep 3
    kill $listener
    wait $listener || fail "no outputs"
    listener=
    peak_kib[$kind]=$(sed -n 's/^VmHWM:[^0-9]*\([0-9]*\) kB/\1/p' /proc/$node/status)
    end INT
    grep 'clouds:' "$map.log" | tail -1 | tee "$map.counters"
    grep -q ' 30 mapped' "$map.counters" || fail "not all clouds were mapped"
    "$voxtile" build "$map.bag" -o "$map.built" --resolution 0.1 --tile-size 10 --max-range 60 >/dev/null
    of_node=$("$voxtile" digest "$map") of_bag=$("$voxtile" digest "$map.built")
    [ "$of_node" = "$of_bag" ] || fail "the map of the node differs: $of_node, not $of_bag"
    [ "$of_node" = "${of_friend:-$of_node}" ] || fail "$kind: the map differs: $of_node, not $of_friend"
    of_friend=$of_node
    "$voxtile" export "$map" -o "$map.csv" --what all >/dev/null
    "$voxtile" export "$map" -o "$map.pgm" --z-max $max_z >/dev/null
    compare $kind live
    if [ $kind = hostile ]; then
        grep -q ' 1 too large' "$map.counters" || fail "a cloud larger than the queue is not counted"
        # The limit covers the message of 17 MiB, the queue of 16 MiB and further messages.
        echo "zenoh: $((peak_kib[friendly] >> 10)) MiB of memory, $((peak_kib[hostile] >> 10)) with a hostile peer"
        [ ${peak_kib[hostile]} -lt $((peak_kib[friendly] + (64 << 10))) ] || fail "a hostile peer takes memory"
        grep -q ' 0 malformed' "$map.counters" && fail "malformed clouds are not counted"
    else
        # The restarted node serves late subscribers. Then the router is replaced.
        start "$map"
        "$python" zenoh_outputs.py $port $domain "$map.outputs" 6 || fail "no outputs"
        compare $kind rest
        if grep -q '"count": [^1]' "$map.outputs"; then
            fail "an unchanged message was published again"
        fi
        "$python" zenoh_services.py $port $domain || fail "services"
        timeout 100 "$python" zenoh_sdk.py $port $domain || fail "zenoh_ros2_sdk"
        end_router
        start_router
        "$python" zenoh_services.py $port $domain again || fail "the node did not reconnect to the router"
        end TERM
        [ "$("$voxtile" digest "$map")" = "$of_node" ] || fail "a restart changes the map"
    fi
    end_router
    echo "zenoh, $kind: $of_node"
done
