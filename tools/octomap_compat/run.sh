#!/bin/sh
# Compares voxtile with the OctoMap library: maps of real scans, every tile's octree.bt, and the .bt and .ot of the map.
#
#   tools/octomap_compat/run.sh [--short]
#
# Needs g++, python3 and liboctomap-dev, and data below ${VOXTILE_DATA:-../shared/data}; missing data sets are skipped.
# --short: the first scans of two data sets at 0.2 m. VOXTILE_BIN is a folder of built programs. Exits with 1 if a
# comparison fails.
set -eu
cd "$(dirname "$0")/../.."
here=tools/octomap_compat
data=${VOXTILE_DATA:-../shared/data}
target=${CARGO_TARGET_DIR:-target}
bin=${VOXTILE_BIN:-$target/release}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

[ -n "${VOXTILE_BIN-}" ] || cargo build --release --quiet --example insert_stream --bin voxtile
for tool in insert tiles merged; do
    # Compiled without fused multiply-add, like Debian's library: with it, rays would visit slightly different voxels.
    # The ray walk is in OctoMap's headers, so it is compiled here. NDEBUG disables the library's debug output.
    g++ -std=c++17 -O2 -DNDEBUG -ffp-contract=off -Wall -o "$work/$tool" "$here/$tool.cpp" -loctomap -loctomath
done

failed=0

compare() { # data set, resolution in metres, maximum number of scans
    if [ ! -d "$data/$1/scans" ]; then
        echo "$1: skipped, not in $data"
        return
    fi
    echo "$1 at $2 m"
    python3 "$here/points.py" "$data/$1" $3 > "$work/stream"
    "$bin/examples/insert_stream" "$work/stream" "$2" "$work/map"
    "$work/insert" "$work/stream" "$2" "$work/map" || failed=1
    "$work/tiles" "$work/map" "$2" || failed=1
    # Little memory, so that the files are assembled from many blocks.
    for format in bt ot; do
        "$bin/voxtile" export "$work/map" -o "$work/whole.$format" --memory 1MiB > /dev/null
    done
    "$work/merged" "$work/map" "$2" "$work/whole.bt" "$work/whole.ot" || failed=1
    rm -r "$work/map"
}

if [ "${1-}" = --short ]; then
    compare fastlio_hku_1 0.2 20
    compare balm_os0_hall 0.2 3
else
    for set in fastlio_hku_1 balm_os0_hall mulran_riverside02_a; do
        for resolution in 0.2 0.1; do
            compare "$set" "$resolution" ""
        done
    done
fi
exit $failed
