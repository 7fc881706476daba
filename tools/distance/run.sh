#!/usr/bin/env bash
# Measures distance fields: bulk computation compared with PyPI's edt and scipy, updates after each scan, points.
#
#   tools/distance/run.sh            all recorded sets, and docs/measurements/distance.md
#   tools/distance/run.sh --short    one set, and tables on standard output
#
# DISTANCE is the program to use; by default, it is built. Needs Python. Data sets are in ${VOXTILE_DATA:-../shared/data};
# missing ones are skipped. Exits with 1 if a field is wrong.
set -euo pipefail
cd "$(dirname "$0")/../.."
data=${VOXTILE_DATA:-../shared/data} target=${CARGO_TARGET_DIR:-target}
distance=${DISTANCE:-$target/release/distance}
output=docs/measurements/distance.md mode=${1:-}
# Name, resolution and cap of bulk fields in metres.
bulk="balm_os0_hall:0.1:5 balm_os0_hall:0.1:2 kitti_0001_a:0.2:5 mulran_riverside02_a:0.2:5 fastlio_hku_1:0.1:5"
live="balm_os0_hall:0.2:2 fastlio_hku_1:0.2:2 kitti_0001_a:0.2:2 mulran_riverside02_a:0.2:2 mulran_riverside02_a:0.2:5"
points="balm_os0_hall:0.2:2 balm_os0_hall:0.1:5"
if [[ $mode == --short ]]; then bulk=balm_os0_hall:0.2:2 live=balm_os0_hall:0.2:2 points=balm_os0_hall:0.2:2; fi

if [[ -z ${DISTANCE:-} ]]; then cargo build --release --quiet --locked --package distance; fi
python=${PYTHON:-$target/distance/venv/bin/python}
if ! "$python" -c 'import edt, scipy' 2>/dev/null; then
    python3 -m venv "$target/distance/venv"
    python=$target/distance/venv/bin/python
    "$python" -m pip install --quiet numpy scipy edt
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
status=0

rows() { # command, sets
    local command=$1 name resolution cap
    for set in $2; do
        IFS=: read -r name resolution cap <<<"$set"
        if [[ ! -d $data/$name ]]; then
            echo "$name: skipped, not in $data" >&2
            continue
        fi
        local run=("$distance" "$data/$name" --resolution "$resolution" --cap "$cap" "$command")
        if [[ $command != bulk ]]; then
            "${run[@]}"
            continue
        fi
        mkdir "$work/bulk"
        "${run[@]}" "$work/bulk"
        "$python" tools/distance/peers.py "$work/bulk" "$name" "$resolution" "$cap" || status=1
        rm -r "$work/bulk"
    done
}

page() {
    cat <<'PAGE'
# Distance fields

Written by `tools/distance/run.sh`. Lengths are in metres, times are CPU times.

![A layer of a hall: free voxels by their distance to the nearest obstacle](distance_hall.png)
![A layer of a street](distance_street.png)

*`balm_os0_hall` at a height of 0.5 m and `kitti_0001_a`, with guarded clearing, at -0.7 m, drawn by `voxtile picture MAP
--distance-slice Z --max-distance 3`.*

## Bulk

One thread. Voxels are those of the output; the surroundings of boxes within the cap are not counted. `folder` reads the
map, computes and writes a field of all its tiles; `box in memory` reads the map and computes one box. `edt` and `scipy`
transform the obstacles of the same box, which are in memory already; they have no cap.

voxblox and FIESTA are not in the table: PyPI, Debian and npm have no package of them, and their sources need ROS. Their
published RMSE to the occupancy's own truth is 0.059 m and 0.045 m, 0.012 m at best; here it is 0.

| set | what | voxel | cap | M voxels | s | M voxels/s | |
|---|---|---:|---:|---:|---:|---:|---|
PAGE
    rows bulk "$bulk"
    cat <<'PAGE'

## Live

`LiveDistances` in a box of 40 x 40 x 8 m, updated after each scan. Rows: changed rows of voxels along x per scan.
Moved: scans after which the box was placed anew and computed as a whole. Equal: the last field is that of the map
computed at once.

| set | voxel | cap | unknown | rows | ms, median | 95 % | largest | moved | ms, median | equal |
|---|---:|---:|---|---:|---:|---:|---:|---:|---:|---|
PAGE
    rows live "$live"
    cat <<'PAGE'

## Points

Distance and gradient of a million points in a box of 40 x 40 x 8 m in memory: random ones, and steps along straight
lines. `nearest`: `nearest_occupied` of the map, one thread.

| set | voxel | cap | points | ns a point, one thread | all threads | `nearest`, ns |
|---|---:|---:|---|---:|---:|---:|
PAGE
    rows points "$points"
    echo
    echo "$(sed -n 's/^model name.*: //p' /proc/cpuinfo | head -n 1), $(nproc) core(s); load $(cut -d ' ' -f 1 /proc/loadavg) at the end of the run."
}

if [[ $mode == --short ]]; then
    page
else
    page >"$work/page.md"
    mv "$work/page.md" "$output"
    echo "$output"
fi
exit "$status"
