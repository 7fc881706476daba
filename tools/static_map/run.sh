#!/usr/bin/env bash
# Measures both rules of clearing on recorded and simulated data: surfaces kept, moving objects removed, CPU time of the
# build; and DUFOMap on two of the sets.
#
#   tools/static_map/run.sh                 all sets, and docs/measurements/clearing.md
#   tools/static_map/run.sh --simulated     simulated sets alone, and tables on standard output
#   tools/static_map/run.sh --short         one set, and tables on standard output
#
# VOXTILE and WORKLOAD are the programs to use; by default, both are built. Needs Python. Data sets are in
# ${VOXTILE_DATA:-../shared/data}; missing ones are skipped. Simulated sets are generated: the same files in each run.
set -euo pipefail
cd "$(dirname "$0")/../.."
data=${VOXTILE_DATA:-../shared/data} target=${CARGO_TARGET_DIR:-target}
voxtile=${VOXTILE:-$target/release/voxtile} workload=${WORKLOAD:-$target/release/workload}
# Name, minimum and maximum range in metres.
lidar="kitti_0001_a:2:50 balm_os0_hall:2:60 mulran_riverside02_a:2:60 fastlio_hku_1:2:60"
camera="sevenscenes_kinect:0.4:4"
simulated_lidar="sim_spinning:2:60 sim_solid_state:2:60"
simulated_camera="sim_camera:0.3:10"
output=docs/measurements/clearing.md mode=${1:-}

if [[ -z ${VOXTILE:-} ]]; then cargo build --release --quiet --locked --package voxtile-cli; fi
if [[ -z ${WORKLOAD:-} ]]; then cargo build --release --quiet --locked --package workload; fi
python=${PYTHON:-$target/static_map/venv/bin/python}
if ! "$python" -c 'import numpy, PIL' 2>/dev/null; then
    python3 -m venv "$target/static_map/venv"
    python=$target/static_map/venv/bin/python
    "$python" -m pip install --quiet numpy pillow
    "$python" -m pip install --quiet dufomap==1.1.1 || echo "DUFOMap cannot be installed" >&2
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Prints the folder of a set; generates simulated ones.
folder_of() {
    if [[ $1 != sim_* ]]; then
        echo "$data/$1"
        return
    fi
    local sensor=${1#sim_}
    [[ -d $work/$1 ]] || "$workload" movers --sensor "${sensor//_/-}" --scans 200 --seed 1 -o "$work/$1" >&2
    echo "$work/$1"
}

# Builds $work/map of a set, given its folder, minimum and maximum range in metres, a resolution in metres, a rule, and
# perhaps more options. Writes CPU seconds and MB to $work/usage.
build() {
    rm -rf "$work/map"
    RAYON_NUM_THREADS=1 "$python" tools/static_map/measured.py "$work/usage" "$voxtile" build "$1/scans" \
        --poses "$1/poses_kitti.txt" -o "$work/map" --resolution "$4" --min-range "$2" --max-range "$3" \
        --storage compact --clearing "$5" --quiet "${@:6}"
}

# Adds a row to $work/rows.md, $work/distance.md and $work/usage.md. Arguments: name of a set, then those of `build`.
row() {
    local name=$1 folder=$2 resolution=$5 rule=$6 cells by_distance cpu_s peak_mb scans
    build "${@:2}"
    "$voxtile" export "$work/map" -o "$work/map.npz" --quiet
    { read -r cells; read -r by_distance; } < <("$python" tools/static_map/score.py "$folder" "$work/map.npz" \
        "$resolution" "$3" "$4" --by-distance)
    rm "$work/map.npz"
    read -r cpu_s peak_mb <"$work/usage"
    scans=$(find "$folder/scans" -name '*.p[cn][dg]' | wc -l)
    echo "| \`$name\` | $resolution | $rule | $cells | $cpu_s |" >>"$work/rows.md"
    if [[ $by_distance =~ [0-9] ]]; then
        echo "| \`$name\` | $resolution | $rule | $by_distance |" >>"$work/distance.md"
    fi
    if is_peer_set "$name" "$resolution"; then
        cpu_s=$(awk -v s="$cpu_s" -v n="$scans" 'BEGIN { printf "%.3f", s / n }')
        echo "| \`$name\` | $resolution | voxtile, $rule | $cells | $cpu_s | $cpu_s | $peak_mb |" >>"$work/peers.md"
    fi
}

# Adds the row of a set at 0.2 m to $work/free.md. Arguments: name of a set, its folder, minimum and maximum range.
free_row() {
    local cells rule
    for rule in octomap guarded; do
        build "$2" "$3" "$4" 0.2 "$rule"
        "$voxtile" export "$work/map" -o "$work/$rule.npz" --what all --quiet
    done
    cells=$("$python" tools/static_map/free_space.py "$2" "$work/octomap.npz" "$work/guarded.npz" 0.2 "$3" "$4")
    rm "$work/octomap.npz" "$work/guarded.npz"
    echo "| \`$1\` | $cells |" >>"$work/free.md"
}

# Adds the row of a labelled set at a resolution in metres to $work/clean.md. Arguments: name of a set, its folder,
# minimum and maximum range, resolution.
clean_row() {
    local flags cells cpu_s peak_mb
    build "${@:2}" guarded --keep-scans
    RAYON_NUM_THREADS=1 "$python" tools/static_map/measured.py "$work/usage" "$voxtile" clean "$work/map" --quiet
    read -r cpu_s peak_mb <"$work/usage"
    "$voxtile" export "$work/map" --scans "$work/flags" --quiet
    flags=$("$python" tools/static_map/flags.py "$2" "$work/flags" "$3" "$4")
    "$voxtile" export "$work/map" -o "$work/map.npz" --quiet
    cells=$("$python" tools/static_map/score.py "$2" "$work/map.npz" "$5" "$3" "$4" | cut -d '|' -f 2-5)
    rm -rf "$work/flags" "$work/map.npz"
    echo "| \`$1\` | $5 | $flags |$cells| $cpu_s | $peak_mb |" >>"$work/clean.md"
}

# Returns whether DUFOMap runs on a set at a resolution.
is_peer_set() { [[ $1 == kitti_0001_a || $1 == sim_spinning ]] && [[ $2 == 0.1 || $2 == 0.2 ]]; }

# Adds rows for DUFOMap to $work/peers.md. Arguments: name of a set, its folder, minimum and maximum range, resolution.
dufomap_rows() {
    local settings cells d_s d_p
    # Inflation of hits in metres and of unknown space in voxels: the settings of the package's example, those of the
    # paper, and the best ones of a search on kitti_0001_a.
    for settings in "0.2 2" "0.2 1" "0.4 1"; do
        read -r d_s d_p <<<"$settings"
        cells=$("$python" tools/static_map/dufomap_row.py "$2" "$5" "$3" "$4" "$d_s" "$d_p" 2>"$work/dufomap.txt") || {
            tail -n 3 "$work/dufomap.txt" >&2
            return 0
        }
        echo "| \`$1\` | $5 | DUFOMap, d_s $d_s m, d_p $d_p | $cells |" >>"$work/peers.md"
    done
}

# Adds the rows of both rules for sets, at a resolution in metres.
rows() {
    local set name min_m max_m rule folder
    for set in $2; do
        IFS=: read -r name min_m max_m <<<"$set"
        folder=$(folder_of "$name")
        if [[ ! -d $folder ]]; then
            echo "skipped: $folder is missing" >&2
            continue
        fi
        for rule in octomap guarded; do row "$name" "$folder" "$min_m" "$max_m" "$1" "$rule"; done
        if is_peer_set "$name" "$1" && "$python" -c 'import dufomap' 2>/dev/null; then
            dufomap_rows "$name" "$folder" "$min_m" "$max_m" "$1"
        fi
        if [[ $1 != 0.4 && ($name == kitti_0001_a || $name == sim_*) ]]; then
            clean_row "$name" "$folder" "$min_m" "$max_m" "$1"
        fi
        if [[ $1 == 0.2 && ($name == kitti_0001_a || $name == sim_*) ]]; then
            free_row "$name" "$folder" "$min_m" "$max_m"
        fi
    done
}

# Prints a table of $work, if it has rows. Arguments: file and header.
table() {
    [[ -f $work/$1 ]] || return 0
    printf '\n%s\n\n' "$2"
    printf '%s\n' "$3" "$4"
    cat "$work/$1"
}

case $mode in
--short)
    rows 0.2 "${lidar%% *}"
    ;;
--simulated)
    rows 0.05 "$simulated_camera"
    rows 0.1 "$simulated_lidar $simulated_camera"
    rows 0.2 "$simulated_lidar"
    ;;
*)
    rows 0.05 "$camera $simulated_camera"
    rows 0.1 "$lidar $camera $simulated_lidar $simulated_camera"
    rows 0.2 "$lidar $simulated_lidar"
    rows 0.4 "$lidar"
    ;;
esac

{
    cat <<'END'
# Clearing

Written by `tools/static_map/run.sh`. Shares are in percent, distances in metres. `sim_*` are recordings of 200 scans
written by `workload movers`: a street with cars, trams, cyclists, walkers close to walls, doors, and parked cars that
leave.

![A street by OctoMap's rule: much of the road is missing](clearing_before.png)
![The same street with guarded clearing](clearing_after.png)

*`kitti_0001_a` with voxels of 0.1 m, drawn by `tools/static_map/pictures.sh`: by OctoMap's rule, and with guarded
clearing after `clean`. Red points are marked as moving. The two trails at the bottom are labelled as moving objects;
other marks, on the road and on parked cars, are errors.*
END
    table rows.md "\
Points: share of all points within the range limit whose voxel the finished map calls occupied. With labels: static and
dynamic accuracy (SA, DA), their geometric mean (AA), DA of moving points whose voxel contains no static point (DA,
other), and points of parked cars that leave in occupied voxels (departed). CPU seconds of the whole build with one
thread." \
        "| set | voxel, m | rule | points | SA | DA | AA | DA, other | departed | CPU s |" \
        "|---|---:|---|---:|---:|---:|---:|---:|---:|---:|"
    table clean.md "\
\`voxtile clean\` of maps with guarded clearing. SA: static points that are not marked; DA: moving points that are marked;
departed: points of parked cars that leave that are not marked. Then SA, DA, AA and DA (other) of the map afterwards, as
above. CPU seconds and memory of \`clean\` with one thread." \
        "| set | voxel, m | SA | DA | AA | departed | map: SA | DA | AA | DA, other | CPU s | peak, MB |" \
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
    table distance.md "By distance from the sensor:" \
        "| set | voxel, m | rule | SA, 0-10 | 10-20 | 20-35 | 35- | DA, 0-10 | 10-20 | 20-35 | 35- |" \
        "|---|---:|---|---:|---:|---:|---:|---:|---:|---:|---:|"
    table free.md "\
State with guarded clearing of the voxels of 0.2 m that are free by OctoMap's rule and contain no point:" \
        "| set | free | unknown |" "|---|---:|---:|"
    table peers.md "\
DUFOMap 1.1.1 (Python package) with one thread. It labels the points of all scans at the end; a point labelled static
counts as one in an occupied voxel. CPU seconds a scan: of the map, and of map and labels. Those of voxtile include
reading the files." \
        "| set | voxel, m | program | points | SA | DA | AA | DA, other | departed | map, s | all, s | peak, MB |" \
        "|---|---:|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
} >"$work/page.md"
# Opening /dev/stdout would truncate a log that it is redirected to.
if [[ $mode == --short || $mode == --simulated ]]; then cat "$work/page.md"; else cp "$work/page.md" "$output"; fi
