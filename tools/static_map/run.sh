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
sets="kitti_0001_a:50 balm_os0_hall:60 mulran_riverside02_a:60 fastlio_hku_1:60" resolutions="0.1 0.2"
output=docs/measurements/clearing.md
if [[ ${1:-} == --short ]]; then sets="kitti_0001_a:50" resolutions="0.2" output=/dev/stdout; fi

cargo build --release --quiet --locked --package voxtile-cli
python=python3
if ! python3 -c 'import numpy' 2>/dev/null; then
    python=$target/static_map/venv/bin/python
    [[ -x $python ]] || { python3 -m venv "$target/static_map/venv" && "$python" -m pip install --quiet numpy; }
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Prints a row for a set, its range limit in metres, a resolution in metres and a rule.
row() {
    local folder=$data/$1 cells
    rm -rf "$work/map"
    RAYON_NUM_THREADS=1 bash -c 'TIMEFORMAT=%U; time "$@" >/dev/null' time "$voxtile" build "$folder/scans" \
        --poses "$folder/poses_kitti.txt" -o "$work/map" --resolution "$3" --min-range 2 --max-range "$2" \
        --storage compact --clearing "$4" --quiet 2>"$work/seconds"
    "$voxtile" export "$work/map" -o "$work/map.npz" --what all --quiet
    cells=$("$python" tools/static_map/score.py "$folder" "$work/map.npz" "$3" "$2")
    rm "$work/map.npz"
    echo "| \`$1\` | $3 | $4 | $cells | $(tail -n 1 "$work/seconds") |"
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
    for resolution in $resolutions; do
        for set in $sets; do
            if [[ ! -d $data/${set%:*} ]]; then
                echo "skipped: $data/${set%:*} is missing" >&2
                continue
            fi
            for rule in octomap guarded; do row "${set%:*}" "${set#*:}" "$resolution" "$rule"; done
        done
    done
} >"$work/table.md"
cat "$work/table.md" >"$output"
