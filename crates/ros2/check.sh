#!/usr/bin/env bash
# Tests the node with an independent peer over loopback (Cyclone DDS from PyPI; for zenoh, eclipse-zenoh). The map of
# the node and the map that `voxtile build` creates from the same messages must have the same digest, even with a
# hostile peer. Outputs must equal those of `voxtile export`; services are also called. Passes with a message if Python
# or PyPI is missing. The test `rclpy` uses ROS 2 itself: rclpy of Jazzy over Fast DDS, from PyPI (for Python 3.11).
#
# check.sh [friendly] [hostile] [types] [variants] [odometry] [launch] [path] [layers] [deskew] [real] [sensors]
#          [flood] [monitoring] [rclpy] [zenoh] [sizes]
#
# sizes, only when named, prints how long clients of each middleware wait for messages of up to 50 MB.
#
# VOXTILE_ROS2_PYTHON is a Python with the packages, VOXTILE_ZENOH_PYTHON one with eclipse-zenoh as well,
# VOXTILE_RCLPY_PYTHON one with rclpy as well. VOXTILE and VOXTILE_ROS2 are built programs, VOXTILE_ROS2_ZENOH is the
# node with the feature `zenoh`.
set -euo pipefail
cd "$(dirname "$0")/../.."

# Some tests run in other folders, so make the path absolute.
built=$(realpath -m "${CARGO_TARGET_DIR:-target}")/debug
work=$(mktemp -d)
node= listener=
trap 'for one in $node $listener; do kill "$one" 2>/dev/null || true; done; rm -rf "$work"' EXIT

python=${VOXTILE_ROS2_PYTHON:-}
if [ -z "$python" ]; then
    python=$work/venv/bin/python
    packages="cyclonedds==11.0.1 eclipse-zenoh zenoh-ros2-sdk rosbags numpy prometheus-client"
    # shellcheck disable=SC2086
    if ! { python3 -m venv "$work/venv" && "$python" -m pip -q install $packages; }; then
        echo "skipped: no Python with cyclonedds and rosbags; set VOXTILE_ROS2_PYTHON"
        exit 0
    fi
fi

voxtile=${VOXTILE:-}
if [ -z "$voxtile" ]; then
    cargo build -q --profile test --locked
    voxtile=$built/voxtile
fi
program=${VOXTILE_ROS2:-}
if [ -z "$program" ] && [ "$*" != zenoh ]; then
    cargo build -q --profile test --locked -p voxtile-ros2
    program=$built/voxtile-ros2
fi
voxtile=$(realpath "$voxtile") program=${program:+$(realpath "$program")}
radius=2.5 max_z=1.0 inflation_range=2.2 layers=colour,intensity=100,class,time,shape
outputs="--max-range 60 --publish-every 0.2 --publish-radius $radius --projected-radius 30 --occupancy-max-z $max_z"
outputs="$outputs --inflation-range $inflation_range"
# As in tests/frontier_outputs.py.
outputs="$outputs --frontiers --frontier-radius 2 --frontier-height 1 --frontier-min-area 0.05 --frontier-every 0.2"

# Prints the failure and the log of the node.
fail() {
    echo "$kind: $*"
    cat "$work/$kind.log"
    exit 1
}

# Starts the node with these options.
start() {
    "$program" -o "$map" --domain-id $domain "$@" >"$work/$kind.log" 2>&1 &
    node=$!
}

# Stops the node with a signal.
end() {
    kill "-$1" "$node"
    wait "$node" || fail "the node failed"
    node=
}

# Records what the node publishes on these topics for this number of seconds.
listen() {
    "$python" crates/ros2/tests/outputs.py listen $domain "$work/$kind.outputs" "$@" &
    listener=$!
}

# Plays the messages of a test to the node.
play() {
    case $kind in
    odometry) start --resolution $resolution $outputs --odometry /odom --frame-id odom ;;
    path) start --resolution $resolution --max-range 60 --publish-every 0.2 --path /slam_path --flush-every 2 ;;
    layers) start --resolution $resolution --max-range 60 --layers $layers --publish-every 0.2 ;;
    deskew) start --resolution $resolution --max-range 60 --deskew --keep-scans ;;
    sensors) start --resolution $resolution $outputs --cloud /cloud_in --cloud /rear ;;
    launch)
        # Starts the node as `ros2 launch` does, with a namespace, a name, parameters and remappings.
        printf '/robot/mapper:\n  ros__parameters: {max_range: 60.0, resolution: 0.7}\n' >"$work/launch.yaml"
        start --publish-every 0.2 --ros-args -r __node:=mapper -r __ns:=/robot --params-file "$work/launch.yaml" \
            -p resolution:=$resolution -r cloud_in:=/cloud_in -r octomap_binary:=/hall/octomap_binary
        ;;
    *) start --resolution $resolution $outputs ;;
    esac
    if [ $kind = path ]; then
        listen 20 octomap_full
    elif [ $kind = layers ]; then
        listen $seconds octomap_point_cloud_centers
    elif [ $kind = launch ]; then
        listen $seconds octomap_binary robot/octomap_full hall/octomap_binary
    else
        listen $seconds
    fi
    "$python" crates/ros2/tests/peer.py $domain "$work/$kind.bag" $count $kind "$street"
    wait "$listener"
    listener=
    end INT
    grep 'clouds:' "$work/$kind.log" | tail -1 | tee "$work/$kind.counters"
}

# Builds a map from the recorded messages.
built_of() {
    "$voxtile" build "$work/$kind.bag" "$@" --resolution $resolution --tile-size 10 --max-range 60 >/dev/null
}

# Sends more clouds than the queue holds: the dropped ones are counted, memory remains bounded, and the node continues
# to map.
flood() {
    local clouds=1500 grown received dropped waiting mapped_before mapped without
    start --memory 128MiB --transform-wait 100 --resolution 0.1
    "$python" crates/ros2/tests/flood.py $domain $clouds $node >"$work/flood.counts" || fail "the peer failed"
    end INT
    read -r grown received dropped waiting mapped_before mapped without <"$work/flood.counts"
    echo "flood: $received received, $dropped dropped, $waiting waited, $mapped mapped; $((grown >> 20)) MiB more"
    [ "$mapped_before" = 0 ] || fail "clouds without transforms were mapped"
    [ "$received" -gt 600 ] || { echo "skipped: most of the flood was lost in transit"; return; }
    [ "$dropped" -gt 0 ] || fail "the queue of 16 MiB dropped nothing"
    [ $((dropped + waiting)) = "$received" ] || fail "some clouds were not counted"
    # The limit covers the queue (16 MiB), the socket buffer (8 MiB) and the caches of rustdds.
    [ "$grown" -lt $((64 << 20)) ] || fail "memory grew by $grown bytes"
    [ $((mapped + without)) = "$waiting" ] && [ "$mapped" -gt 0 ] || fail "the waiting clouds were not mapped"
}

# Dropped clouds are explained in the log, metrics and health are served, and files of octomap_server are read.
monitoring() {
    local address options topics="mapped unknown registered malformed late"
    printf 'octomap_server:\n  ros__parameters:\n    filter_ground_plane: some\n' >"$work/octomap_server.yaml"
    local status=0 refusal
    refusal=$("$program" -o "$map" --params-file "$work/octomap_server.yaml" 2>&1) || status=$?
    [ $status = 2 ] && [[ $refusal == *"octomap_server.yaml:3: parameter filter_ground_plane: invalid type"* ]] ||
        fail "a wrong value is not refused: $refusal"
    sed -i s/some/false/ "$work/octomap_server.yaml"
    # `cloud_in` is the default of the launch file.
    options=$("$python" crates/ros2/tests/launch_file.py "output:=$map" "params_file:=$work/octomap_server.yaml" \
        metrics:=0) || fail "the launch file"
    # shellcheck disable=SC2046,SC2086
    start --resolution 0.1 --flush-every 2 --log-format json $(printf -- '--cloud %s ' $topics) $options
    "$python" crates/ros2/tests/monitoring.py send $domain 7 || fail "the peer failed"
    address=$(sed -n 's|.*serving http://\([0-9.:]*\)/metrics.*|\1|p' "$work/$kind.log")
    "$python" crates/ros2/tests/monitoring.py metrics "${address#*:}" || fail "metrics"
    [[ $("$program" health "$address") == ok* ]] || fail "the node is not healthy"
    end INT
    ! "$program" health "$address" >/dev/null || fail "a node that has ended is healthy"
    "$python" crates/ros2/tests/monitoring.py log "$work/$kind.log" || fail "the log"
    echo "monitoring: causes, metrics, health"
}

# Exchanges messages and service calls with nodes of ROS 2 itself and its default middleware.
rclpy() {
    local python=${VOXTILE_RCLPY_PYTHON:-$work/venv_ros/bin/python}
    if [ -z "${VOXTILE_RCLPY_PYTHON:-}" ]; then
        local packages="rclpy rmw-fastrtps-cpp sensor-msgs nav-msgs std-srvs visualization-msgs diagnostic-msgs"
        # shellcheck disable=SC2046,SC2086
        if ! { python3 -m venv "$work/venv_ros" && "$python" -m pip -q install cyclonedds==11.0.1 rosbags numpy \
            $(printf 'ros-jazzy-%s ' $packages); }; then
            echo "skipped: no Python with rclpy; set VOXTILE_RCLPY_PYTHON"
            return
        fi
    fi
    for attempt in 1 2 3; do
        domain=$((RANDOM % 100 + 100))
        rm -rf "$map" "$map.saved" "$work/rclpy.bag"
        start --resolution $resolution $outputs --odometry /odom --frame-id odom
        "$python" crates/ros2/tests/rclpy_peer.py $domain "$work/rclpy.bag" $count "$voxtile" "$map" $radius $max_z ||
            fail "the peer failed"
        end INT
        if grep -q " $count mapped" "$work/rclpy.log"; then break; fi
        grep -q "clouds: $count received" "$work/rclpy.log" && fail "all clouds were received, but not all were mapped"
        if [ $attempt = 3 ]; then
            echo "skipped: clouds were lost in transit three times"
            return
        fi
    done
    built_of -o "$map.built" --odometry /odom
    of_node=$("$voxtile" digest "$map.saved") of_bag=$("$voxtile" digest "$map.built")
    [ "$of_node" = "$of_bag" ] || fail "the map of the node differs: $of_node, not $of_bag"
    echo "rclpy: $of_node"
}

# Builds the node with the feature `zenoh`, which is off by default.
zenoh() {
    local python=${VOXTILE_ZENOH_PYTHON:-$python} program=${VOXTILE_ROS2_ZENOH:-}
    if ! "$python" -c 'import zenoh, zenoh.ext, cyclonedds, rosbags' 2>/dev/null; then
        echo "skipped: no Python with eclipse-zenoh; set VOXTILE_ZENOH_PYTHON"
        return
    fi
    if [ -z "$program" ]; then
        cargo build -q --profile test --locked -p voxtile-ros2 --features zenoh
        program=$built/voxtile-ros2
    fi
    program=$(realpath "$program")
    export python voxtile program outputs radius max_z inflation_range
    crates/ros2/tests/zenoh.sh "$work"
}

# Prints the waiting times for messages of several sizes, with the buffers of sockets that this machine has.
sizes() {
    local script=$PWD/crates/ros2/tests/message_sizes.py middleware radius port router client options
    "$python" "$script" scan "$work/half.ply"
    "$voxtile" build "$work/half.ply" -o "$map" --poses identity --resolution 0.1 --max-range 40 --quiet
    echo "sizes: net.core.rmem_default $(cat /proc/sys/net/core/rmem_default), rmem_max $(cat /proc/sys/net/core/rmem_max)"
    for middleware in cyclonedds fastdds zenoh; do
        options=() client=$python router=
        port=$((RANDOM % 10000 + 20000))
        case $middleware in
        cyclonedds) options=(--rmw cyclonedds) ;;
        fastdds)
            client=${VOXTILE_RCLPY_PYTHON:-}
            [ -n "$client" ] || { echo "fastdds: skipped; set VOXTILE_RCLPY_PYTHON" && continue; }
            ;;
        zenoh)
            options=(--transport zenoh --zenoh-router tcp/127.0.0.1:$port)
            (cd crates/ros2/tests && exec "$python" zenoh_router.py $port) >/dev/null 2>&1 &
            router=$!
            ;;
        esac
        for radius in 1 2.5 4 6 10; do
            domain=$((RANDOM % 100 + 100))
            start --publish-radius $radius --publish-every 0.2 "${options[@]}"
            sleep 3
            "$client" "$script" $middleware $domain $port | sed "s/^/$middleware /"
            end INT
        done
        if [ -n "$router" ]; then kill $router; fi
    done
}

# Folder of real clouds, if available.
street=${VOXTILE_DATA:-../shared/data}/mulran_riverside02_a
for kind in ${*:-friendly hostile types variants odometry launch path layers deskew real sensors flood monitoring rclpy zenoh}; do
    map=$work/$kind count=30 resolution=0.1 seconds=12
    if [ $kind = zenoh ] || [ $kind = rclpy ] || [ $kind = sizes ]; then
        $kind
        continue
    fi
    if [ $kind = flood ] || [ $kind = monitoring ]; then
        domain=$((RANDOM % 100 + 100))
        $kind
        continue
    fi
    sent=$count
    case $kind in
    real)
        count=75 sent=75 resolution=0.2 seconds=20
        [ -d "$street/scans" ] || continue
        ;;
    hostile) sent=90 ;;
    sensors) sent=60 ;;
    path) sent=50 ;;
    esac
    # Clouds are best effort: a busy machine loses some in transit, which is no failure of the node.
    mapped=$([ $kind = hostile ] && echo $count || echo $sent)
    for attempt in 1 2 3; do
        domain=$((RANDOM % 100 + 100))
        rm -rf "$map" "$work/$kind.bag"
        play
        if grep -q " $mapped mapped" "$work/$kind.counters"; then break; fi
        if grep -q "clouds: $sent received" "$work/$kind.counters"; then
            fail "all clouds were received, but not all were mapped"
        fi
        if [ $attempt = 3 ]; then
            echo "skipped: clouds were lost in transit three times"
            exit 0
        fi
    done
    case $kind in
    sensors)
        # The clouds of the two sensors do not overlap, so their order does not matter: the map is the union of two
        # maps.
        for topic in cloud_in rear; do
            built_of -o "$map.$topic" --topic /$topic
            "$voxtile" export "$map.$topic" -o "$map.$topic.csv" --what all >/dev/null
        done
        "$voxtile" export "$map" -o "$map.csv" --what all >/dev/null
        cmp <(sort "$map.csv") <(sort -u "$map.cloud_in.csv" "$map.rear.csv") || fail "the map differs"
        echo "sensors: $(wc -l <"$map.cloud_in.csv") and $(wc -l <"$map.rear.csv") rows in one map"
        continue
        ;;
    odometry) built_of -o "$map.built" --odometry /odom ;;
    layers) built_of -o "$map.built" --layers $layers ;;
    deskew) built_of -o "$map.built" --deskew --keep-scans ;;
    path)
        # The path covers only the first clouds; later ones keep their poses.
        built_of -o "$map.built" --keep-scans --count $count
        before=$("$voxtile" digest "$map.built")
        "$voxtile" remap "$map.built" --poses "$work/$kind.bag.tum" >/dev/null
        [ "$("$voxtile" digest "$map.built")" != "$before" ] || fail "the path moves nothing"
        "$voxtile" build "$work/$kind.bag" -o "$map.built" --resume --max-range 60 >/dev/null
        ;;
    *) built_of -o "$map.built" ;;
    esac
    if [ $kind = hostile ]; then
        grep -q 'has the parent lidar, which closes a loop (map in lidar.*; publisher: ' "$work/$kind.log" ||
            fail "a loop of frames is not reported"
        [ "$(grep -c 'which closes a loop\|has two parents' "$work/$kind.log")" -le 6 ] || fail "too many warnings"
    fi
    of_node=$("$voxtile" digest "$map") of_bag=$("$voxtile" digest "$map.built")
    [ "$of_node" = "$of_bag" ] || fail "the map of the node differs: $of_node, not $of_bag"
    if [ $kind = layers ]; then
        of_node=$("$voxtile" digest --layers "$map") of_bag=$("$voxtile" digest --layers "$map.built")
        [ "$of_node" = "$of_bag" ] || fail "the layers of the node differ: $of_node, not $of_bag"
        "$voxtile" export "$map" -o "$map.csv" >/dev/null
        "$python" crates/ros2/tests/outputs.py colours "$work/$kind.outputs" "$map.csv" || fail "the colours differ"
        echo "$kind: $of_node"
        continue
    fi
    if [ $kind = deskew ]; then
        of_node=$("$voxtile" digest --scans "$map") of_bag=$("$voxtile" digest --scans "$map.built")
        [ "$of_node" = "$of_bag" ] || fail "the kept scans of the node differ: $of_node, not $of_bag"
        built_of -o "$map.skewed"
        [ "$("$voxtile" digest "$map.skewed")" != "$("$voxtile" digest "$map")" ] || fail "deskewing has no effect"
        grep -q '1 cloud deskewed in part' "$work/$kind.log" || fail "the last cloud has all transforms"
        echo "$kind: $of_node"
        continue
    fi
    if [ $kind = path ]; then
        # The remapped tiles were published, and no scan was mapped twice.
        grep -q 'remapped: 30 of' "$work/$kind.log" || fail "nothing was remapped"
        "$voxtile" export "$map" -o "$map.csv" --what all >/dev/null
        "$python" crates/ros2/tests/outputs.py whole "$work/$kind.outputs" "$map.csv"
        echo "$kind: $of_node"
        continue
    fi
    if [ $kind = launch ]; then
        for name in robot/octomap_full hall/octomap_binary; do
            grep -q "\"$name\"" "$work/$kind.outputs" || fail "nothing is published as /$name"
        done
        grep -q '"octomap_binary":' "$work/$kind.outputs" && fail "a name was not remapped"
        echo "$kind: $of_node"
        continue
    fi
    if [ $kind = odometry ]; then
        echo "$kind: $of_node"
        continue
    fi
    "$voxtile" export "$map" -o "$map.csv" --what all >/dev/null
    "$voxtile" export "$map" -o "$map.pgm" --z-max $max_z >/dev/null
    compare() {
        [ $kind = real ] || "$python" crates/ros2/tests/outputs.py compare \
            "$work/$kind.outputs" "$map.csv" "$map.pgm" $count $radius $max_z $1 $inflation_range
    }
    compare live
    # The node continues the map. Without new clouds the map does not change, and each topic is published once.
    start --rmw cyclonedds $outputs
    listen 4
    wait "$listener"
    listener=
    compare rest
    if grep -q '"count": [^1]' "$work/$kind.outputs"; then
        echo "$kind: an unchanged message was published again"
        exit 1
    fi
    [ $kind = real ] || "$python" crates/ros2/tests/services.py $domain || fail "services"
    end TERM
    grep -q "map at scan $count" "$work/$kind.log" || fail "scans are missing"
    [ "$("$voxtile" digest "$map")" = "$of_node" ] || fail "a restart changes the map"
    # Point layouts and additional senders do not affect the map.
    [ $kind = friendly ] && of_friend=$of_node
    if [ $kind != real ] && [ "$of_node" != "${of_friend:-$of_node}" ]; then
        fail "the map differs from that of friendly: $of_node, not $of_friend"
    fi
    echo "$kind: $of_node"
done
