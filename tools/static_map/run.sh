#!/usr/bin/env bash
# Measures both rules of clearing on recorded data: surfaces kept, moving objects removed, CPU time of the build.
#
#   tools/static_map/run.sh            all sets, and docs/measurements/clearing.md
#   tools/static_map/run.sh --short    one set, and a table on standard output
#
# Needs Python. Data sets are in ${VOXTILE_DATA:-../shared/data}; missing ones are skipped.
set -euo pipefail
cd "$(dirname "$0")/../.."
data=${VOXTILE_DATA:-../shared/data} target=${CARGO_TARGET_DIR:-target}
voxtile=$target/release/voxtile
# Name, minimum and maximum range in metres.
lidar="kitti_0001_a:2:50 balm_os0_hall:2:60 mulran_riverside02_a:2:60 fastlio_hku_1:2:60"
camera="sevenscenes_kinect:0.4:4"
output=docs/measurements/clearing.md

cargo build --release --quiet --locked --package voxtile-cli
python=python3
if ! python3 -c 'import numpy, PIL' 2>/dev/null; then
    python=$target/static_map/venv/bin/python
    [[ -x $python ]] || { python3 -m venv "$target/static_map/venv" && "$python" -m pip install --quiet numpy pillow; }
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Prints a row for a set, its minimum and maximum range in metres, a resolution in metres and a rule.
row() {
    local folder=$data/$1 cells
    rm -rf "$work/map"
    RAYON_NUM_THREADS=1 bash -c 'TIMEFORMAT=%U; time "$@" >/dev/null' time "$voxtile" build "$folder/scans" \
        --poses "$folder/poses_kitti.txt" -o "$work/map" --resolution "$4" --min-range "$2" --max-range "$3" \
        --storage compact --clearing "$5" --quiet 2>"$work/seconds"
    "$voxtile" export "$work/map" -o "$work/map.npz" --what all --quiet
    cells=$("$python" tools/static_map/score.py "$folder" "$work/map.npz" "$4" "$2" "$3")
    rm "$work/map.npz"
    echo "| \`$1\` | $4 | $5 | $cells | $(tail -n 1 "$work/seconds") |"
}

# Prints the rows of both rules for sets, at a resolution in metres.
rows() {
    local set name min_m max_m rule
    for set in $2; do
        IFS=: read -r name min_m max_m <<<"$set"
        if [[ ! -d $data/$name ]]; then
            echo "skipped: $data/$name is missing" >&2
            continue
        fi
        for rule in octomap guarded; do row "$name" "$min_m" "$max_m" "$1" "$rule"; done
    done
}

{
    cat <<'END'
# Clearing

Written by `tools/static_map/run.sh`. Share of all points within the range limit whose voxel the finished map calls
occupied, in percent; with labels, static (SA) and dynamic accuracy (DA), and their geometric mean (AA). CPU seconds of
the whole build with one thread.

| set | voxel, m | rule | points kept | SA | DA | AA | CPU s |
|---|---:|---|---:|---:|---:|---:|---:|
END
    if [[ ${1:-} == --short ]]; then
        rows 0.2 "${lidar%% *}"
    else
        rows 0.05 "$camera"
        rows 0.1 "$lidar $camera"
        rows 0.2 "$lidar"
        rows 0.4 "$lidar"
    fi
} >"$work/table.md"
if [[ ${1:-} == --short ]]; then output=/dev/stdout; fi
cat "$work/table.md" >"$output"
