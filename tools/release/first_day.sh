#!/usr/bin/env bash
# Uses the programs of a release as new users would, without a checkout's build: nine ways, each with its time.
#
#   tools/release/first_day.sh RELEASE     exits with 1 if one failed
#
# RELEASE: the folder that run.sh wrote. Recorded scans and point clouds come from VOXTILE_DATA (default:
# ../shared/data); ways that need missing ones are skipped. Needs python3 of 3.10 or newer and PyPI (numpy, rasterio,
# laspy, pyoctomap, moto, cyclonedds).
set -euo pipefail

fail() { echo "first_day: $*" >&2 && exit 2; }

[[ $# -eq 1 ]] || fail "which release? see the head of $0"
release=$(realpath "$1")
[[ -e $release/SHA256SUMS ]] || fail "$release: not written by tools/release/run.sh"
repository=$(realpath "$(dirname "$0")/../..")
data=$(realpath "${VOXTILE_DATA:-$repository/../shared/data}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

tar --extract --gzip --strip-components 1 --file "$release"/voxtile-*-"$(uname -m)"-unknown-linux-gnu.tar.gz
export PATH=$work/bin:$PATH
# Installs packages into an environment of their own: name, packages.
environment() {
    python3 -m venv "$1"
    "$1/bin/pip" install --quiet --find-links "$release" "${@:2}"
}
environment venv voxtile rasterio laspy lazrs pyoctomap matplotlib
python=$work/venv/bin/python

# Waits until a command succeeds, at most 20 s.
until_it() {
    for _ in $(seq 200); do
        if "$@" >/dev/null 2>&1; then return; fi
        sleep 0.1
    done
    echo "not within 20 s: $*"
    return 1
}

# A first map, without data.
first_map() {
    voxtile demo --out demo
    voxtile query demo/map_tiles 12.3 -4.5 1.0
    voxtile verify demo/map_tiles
}

# A robot's own scans, interrupted and resumed.
robot() {
    voxtile scans "$data/kitti_0001_a"
    voxtile build "$data/kitti_0001_a" -o street --resolution 0.2 --max-range 60 --count 5 --keep-scans
    voxtile build "$data/kitti_0001_a" -o street --resume --max-range 60
    voxtile build "$data/kitti_0001_a" -o whole --resolution 0.2 --max-range 60 --keep-scans
    test "$(voxtile digest street)" = "$(voxtile digest whole)"
}

# A live robot with ROS 2, beside an independent peer.
ros() {
    environment peers cyclonedds==11.0.1 eclipse-zenoh zenoh-ros2-sdk rosbags numpy prometheus-client
    VOXTILE=$work/bin/voxtile VOXTILE_ROS2=$work/bin/voxtile-ros2 VOXTILE_ROS2_ZENOH=$work/bin/voxtile-ros2 \
        VOXTILE_ROS2_PYTHON=$work/peers/bin/python "$repository/crates/ros2/check.sh" friendly zenoh
}

# A surveyor: airborne laser scans to a raster of heights, and a part of the map.
surveyor() {
    voxtile build "$data/las_large_coords/autzen_trim.laz" -o survey --resolution 1 --world-frame --no-rays \
        --skip-class 7,18 --layers colour,class
    voxtile export survey -o heights.tif
    voxtile export survey -o survey.laz
    "$python" -c '
import laspy, rasterio
with rasterio.open("heights.tif") as heights:
    assert heights.read(1, masked=True).max() > 0
points = laspy.read("survey.laz")
assert len(points) > 10000 and points.red.max() > 0'
}

# A notebook, from the wheel alone.
notebook() {
    "$python" -c '
import numpy, voxtile
with voxtile.Map.create("notes", resolution=0.1) as room:
    room.insert(numpy.random.default_rng(1).normal(size=(1000, 3)) * 3, origin=[0.0, 0.0, 0.0])
    assert "<img" in room._repr_html_()
    assert (room.occupancy([[0.0, 0.0, 0.05]]) < 0.5).all()'
    "$work/venv/bin/voxtile" info notes
}

# A user of OctoMap.
octomap() {
    voxtile export street -o street.bt
    voxtile import street.bt -o imported
    voxtile export imported -o again.bt
    cmp street.bt again.bt
    "$python" -c '
import pyoctomap
tree = pyoctomap.OcTree(0.2)
assert tree.readBinary("street.bt") and tree.getNumLeafNodes() > 1000'
}

# A planner: distances to obstacles.
planner() {
    voxtile distance street -o field --max-distance 2
    voxtile raycast street --origin 0 0 0 --direction 1 0 0 || test $? -eq 1
}

# An operator: metrics, damage, a fleet's bucket.
operator() {
    environment store 'moto[s3,server]==5.2.5'
    "$work/store/bin/moto_server" -H 127.0.0.1 -p 5055 >moto.log 2>&1 &
    export AWS_ACCESS_KEY_ID=a AWS_SECRET_ACCESS_KEY=b AWS_REGION=us-east-1 AWS_ENDPOINT=http://127.0.0.1:5055
    export AWS_ALLOW_HTTP=true
    until_it curl --silent --fail -X PUT http://127.0.0.1:5055/fleet
    voxtile push street s3://fleet/robot
    test "$(voxtile digest s3://fleet/robot)" = "$(voxtile digest street)"
    cp -r street damaged
    local tile
    tile=$(find damaged \( -name iwlo_meta.bin -o -name tile.vxt \) -print -quit)
    printf 'x' | dd of="$tile" bs=1 seek=100 conv=notrunc status=none
    if voxtile verify damaged; then return 1; fi
    voxtile repair damaged || test $? -eq 1
    voxtile verify damaged
}

# Pictures, report, page.
looker() {
    voxtile picture street -o street.png
    voxtile report street -o street.html
    voxtile view street --no-browser --listen 127.0.0.1:5056 --token first_day &
    until_it curl --silent --fail http://127.0.0.1:5056/first_day/
    curl --silent --fail http://127.0.0.1:5056/first_day/metrics | grep -q '^voxtile_'
}

failed=""
for way in first_map robot ros surveyor notebook octomap planner operator looker; do
    case $way in
    robot | octomap | planner | operator | looker) needed=$data/kitti_0001_a ;;
    surveyor) needed=$data/las_large_coords ;;
    *) needed=$work ;;
    esac
    if [[ ! -d $needed ]]; then
        echo "$way: skipped; $needed is missing"
        continue
    fi
    began=$SECONDS
    # A subshell, in which the first error ends the way. Servers end with it.
    set +e
    (set -e; trap 'kill $(jobs -p) 2>/dev/null || true' EXIT; $way) >"$way.log" 2>&1
    status=$?
    set -e
    if [[ $status -eq 0 ]]; then
        echo "$way: ran in $((SECONDS - began)) s"
    else
        failed=1
        tail -n 20 "$way.log" | sed "s/^/$way: /"
        echo "$way: **failed**"
    fi
done
[[ ! $failed ]]
