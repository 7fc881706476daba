#!/bin/sh
# Checks that the same scans give the same map in many formats: `inputs.py` writes them with third-party libraries,
# `voxtile build` reads them, and the digests are compared.
#
#   tools/interchange/inputs.sh
#
# Needs python3 with venv; its packages are put into a temporary folder. VOXTILE_BIN is a folder of built programs.
# Exits with 1 if digests differ that must be equal.
set -eu
cd "$(dirname "$0")/../.."
here=tools/interchange
target=${CARGO_TARGET_DIR:-target}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

[ -n "${VOXTILE_BIN-}" ] || cargo build --release --quiet --bin voxtile
voxtile=${VOXTILE_BIN:-$target/release}/voxtile
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check numpy plyfile 'laspy[lazrs]' pye57 rosbags
"$work/venv/bin/python" "$here/inputs.py" "$work/in"

failed=0
digest_of() { # input, options
    rm -rf "$work/map"
    "$voxtile" --quiet build "$@" -o "$work/map" --resolution 0.2 --max-range 50 >/dev/null || return
    "$voxtile" digest "$work/map"
}
wanted=$(digest_of "$work/in/pcd")
compare() { # name, input, options
    name=$1
    shift
    found=$(digest_of "$@") || found=none
    if [ "$found" = "$wanted" ]; then
        printf '%-28s same digest\n' "$name"
    else
        printf '%-28s %s, not %s\n' "$name" "$found" "$wanted"
        failed=1
    fi
}
in=$work/in
compare "PLY, binary" "$in/ply"
compare "PLY, text" "$in/ply_text"
compare "text" "$in/xyz"
compare "KITTI .bin" "$in/kitti"
compare "KITTI .bin, poses by stamp" "$in/stamped"
compare "KITTI .bin, poses as .npy" "$in/kitti" --poses "$in/poses.npy"
compare "ROS 1 bag, tf" "$in/scans.bag"
compare "ROS 1 bag, poses from a file" "$in/scans.bag" --poses "$in/pcd/poses_tum.txt"
compare "ROS 2 folder of MCAP, tf" "$in/rosbag2"
compare "MCAP, tf" "$in/rosbag2/rosbag2.mcap"
compare "E57, its own poses" "$in/scans.e57"
if "$voxtile" scans "$in/sqlite" >/dev/null 2>&1; then
    compare "ROS 2 folder of SQLite, tf" "$in/sqlite"
else
    echo "ROS 2 folder of SQLite       skipped: built without the feature sqlite"
fi

# Coordinates are in the world frame and rounded to 0.1 mm: nearly every voxel is the same.
digest_of "$in/pcd" >/dev/null
mv "$work/map" "$work/exact"
digest_of "$in/scans.laz" --world-frame --poses "$in/laz_poses.txt" >/dev/null
count_of() { # name of a count; reads JSON from standard input
    sed -n "s/.*\"$1\": *\([0-9]*\).*/\1/p" | head -1
}
voxels=$("$voxtile" info "$work/exact" --json | count_of voxels)
"$voxtile" diff "$work/exact" "$work/map" --json | sed 's/"tiles":.*//' >"$work/diff"
differ=0
for change in appeared gone to_occupied to_free; do
    differ=$((differ + $(count_of $change <"$work/diff")))
done
echo "LAZ, cut by GPS time: $differ of $voxels voxels differ"
[ "$voxels" -gt 0 ] && [ $((differ * 100)) -lt "$voxels" ] || failed=1
exit $failed
