#!/usr/bin/env bash
# Draws docs/measurements/clearing_before.png and clearing_after.png: a street with voxels of 0.1 m by OctoMap's rule, and
# with guarded clearing and `clean`, with the points that `clean` marks.
#
#   tools/static_map/pictures.sh
#
# VOXTILE is the program to use; by default, it is built. kitti_0001_a is in ${VOXTILE_DATA:-../shared/data}.
set -euo pipefail
cd "$(dirname "$0")/../.."
set_folder=${VOXTILE_DATA:-../shared/data}/kitti_0001_a
voxtile=${VOXTILE:-${CARGO_TARGET_DIR:-target}/release/voxtile}
max_bytes=200000
if [[ ! -d $set_folder ]]; then
    echo "$set_folder is missing" >&2
    exit 1
fi
if [[ -z ${VOXTILE:-} ]]; then cargo build --release --quiet --locked --package voxtile-cli; fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Draws docs/measurements/clearing_NAME.png. Arguments: name, folder of the map, which is its title, more options.
draw() {
    local file=docs/measurements/clearing_$1.png
    "$voxtile" picture "$work/$2" -o "$file" --region 30 -16 -5 90 16 8 --size 1200 --no-grid "${@:3}"
    if (($(wc -c <"$file") > max_bytes)); then
        echo "$file has more than $max_bytes bytes" >&2
        exit 1
    fi
}

# Builds a map in a folder of $work, with further options.
build() {
    "$voxtile" build "$set_folder/scans" --poses "$set_folder/poses_kitti.txt" -o "$work/$1" --resolution 0.1 \
        --min-range 2 --max-range 50 --storage compact --quiet "${@:2}"
}

build octomap
draw before octomap
build guarded-clean --clearing guarded --keep-scans
"$voxtile" clean "$work/guarded-clean"
draw after guarded-clean --moving
