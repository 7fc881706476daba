#!/bin/sh
# Maps a recording without poses: KISS-ICP estimates the poses of a simulated drive from its points alone, voxtile maps
# with them, and the map is compared with that of the true poses.
#
#   tools/interchange/kiss_icp.sh
#
# Needs python3 with venv; its packages are put into a temporary folder. VOXTILE_BIN is a folder with a built `voxtile`
# and `workload`. Exits with 1 if the maps or the poses differ by more than kiss_icp.py allows.
set -eu
cd "$(dirname "$0")/../.."
here=tools/interchange
target=${CARGO_TARGET_DIR:-target}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
resolution=0.2

if [ -z "${VOXTILE_BIN-}" ]; then
    cargo build --release --quiet --bin voxtile
    cargo build --release --quiet --package workload
    VOXTILE_BIN=$target/release
fi
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check 'kiss-icp>=1.3,<2' numpy rosbags
python=$work/venv/bin/python

# Along a street and around a corner at 36 km/h: a scan every metre.
"$VOXTILE_BIN/workload" drive --seed 2 --first 110 --scans 120 --rays 32768 -o "$work/drive.scans"
"$python" "$here/kiss_icp.py" record "$work/drive.scans" "$work"

kiss_icp_out_dir=$work/kiss_icp "$work/venv/bin/kiss_icp_pipeline" "$work/drive.bag" >"$work/kiss_icp.log" 2>&1 || {
    tail -5 "$work/kiss_icp.log"
    exit 1
}
kitti=$work/kiss_icp/latest/drive_poses_kitti.txt
tum=$work/kiss_icp/latest/drive_poses_tum.txt

failed=0
"$python" "$here/kiss_icp.py" align "$work/true_tum.txt" "$kitti" "$work/aligned_tum.txt" || failed=1
# Poses whose stamps are 40 ms late, like log times of a recording, which KISS-ICP uses as stamps.
awk '{ $1 = sprintf("%.4f", $1 + 0.04); print }' "$tum" >"$work/late_tum.txt"

map_with() { # poses, name
    "$VOXTILE_BIN/voxtile" --quiet build "$work/drive.bag" --poses "$1" --first 10 -o "$work/map" \
        --resolution $resolution --max-range 40 >/dev/null
    "$VOXTILE_BIN/voxtile" --quiet export "$work/map" -o "$work/$2.npz" >/dev/null
    rm -r "$work/map"
}
compare() { # poses, name, options
    map_with "$1" found
    shift
    "$python" "$here/kiss_icp.py" compare "$1" "$work/true.npz" "$work/found.npz" $resolution ${2-} || failed=1
}
map_with "$work/aligned_tum.txt" true
compare "$kitti" "poses_kitti.txt, one line per scan"
compare "$tum" "poses_tum.txt, by time"
compare "$work/late_tum.txt" "poses_tum.txt, logged 40 ms late" --shown-only
exit $failed
