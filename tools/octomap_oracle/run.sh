#!/bin/sh
# Compares voxtile's .bt and .ot files with those of the OctoMap library (Debian: liboctomap-dev, g++).
#
#   tools/octomap_oracle/run.sh [COUNT]      COUNT random trees, 500 by default
#
# VOXTILE_BIN is a folder of built programs.
set -eu

count=${1:-500}
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
# OctoMap reports its progress on stderr, which is redirected to a log.
trap 'rm -rf "$work"' EXIT

g++ -std=c++17 -O1 "$here/roundtrip.cpp" -o "$work/roundtrip" -loctomap -loctomath
[ -n "${VOXTILE_BIN-}" ] || cargo build --quiet --release --manifest-path "$here/../../Cargo.toml" --example octree_files
ours=${VOXTILE_BIN:-${CARGO_TARGET_DIR:-$here/../../target}/release}/examples/octree_files

"$work/roundtrip" make "$work" "$count" 2>"$work/octomap.log"
n=0
while [ "$n" -lt "$count" ]; do
    tree=$work/$n
    "$ours" "$tree.ot" "$tree.ours.ot" "$tree.ot" "$tree.ours.bt"
    cmp "$tree.ot" "$tree.ours.ot"
    cmp "$tree.expected.bt" "$tree.ours.bt"
    n=$((n + 1))
done
echo "$count trees of OctoMap: voxtile writes the same .ot and .bt bytes"
"$work/roundtrip" own "$work" 2>"$work/octomap.log"
