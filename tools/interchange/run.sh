#!/bin/sh
# Reads the output of `voxtile export` with other programs: PCL, plyfile, pypcd4 and OctoMap, and without --short also
# Open3D and CloudCompare. Every point must be read back in its voxel, near the origin and far from it (UTM, ECEF). Of a
# map with layers, colours and other values of all formats must be those of the points (layers.py).
#
#   tools/interchange/run.sh [--short]
#
# Needs python3 with venv, and from Debian: g++, libeigen3-dev, libboost-dev, libpcl-io (the library only; PCL's headers
# are unpacked to a temporary folder, as libpcl-dev needs a gigabyte), liboctomap-dev; without --short also cloudcompare
# and python3-open3d. Installs Python packages into a temporary folder. VOXTILE_BIN is a folder of built programs. Exits
# with 1 if a comparison fails.
set -eu
cd "$(dirname "$0")/../.."
here=tools/interchange
target=${CARGO_TARGET_DIR:-target}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

[ -n "${VOXTILE_BIN-}" ] || cargo build --release --quiet --bin voxtile
voxtile=${VOXTILE_BIN:-$target/release}/voxtile

python3 -m venv "$work/venv"
packages="plyfile pypcd4 laspy[lazrs] pye57 rasterio trimesh mcap mcap-ros2-support"
[ "${1-}" = --short ] || packages="$packages pyarrow"
# shellcheck disable=SC2086
"$work/venv/bin/pip" install --quiet --disable-pip-version-check --no-compile $packages
python=$work/venv/bin/python

# The package manager may download as another user, who must be able to write there.
chmod 755 "$work" && mkdir -m 777 "$work/pcl"
(cd "$work/pcl" && apt-get download -qq libpcl-dev >/dev/null && dpkg -x libpcl-dev_*.deb .)
library() { # name without its version
    ls /usr/lib/*/"$1".so* | sort | tail -1
}
g++ -std=c++17 -O1 -w -I "$(ls -d "$work"/pcl/usr/include/pcl-*)" -I /usr/include/eigen3 "$here/pcl_reader.cpp" \
    -o "$work/pcl_reader" "$(library libpcl_io)" "$(library libpcl_common)"
for program in octomap_reader color_octree; do
    g++ -std=c++17 -O1 -w "$here/$program.cpp" -o "$work/$program" -loctomap -loctomath
done

failed=0
resolution=0.2

compare() { # table, file, program, options; reads points from standard input
    python3 "$here/compare.py" "$1" $resolution "$2" "$3" ${4-} || failed=1
}

# Builds a map far from the origin, from the occupied voxels of the near map and a PCD viewpoint at x, y, z.
far_map() { # name, x, y, z
    cloud=$work/$1.pcd
    {
        printf 'VERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH %s\nHEIGHT 1\n' "$points"
        printf 'VIEWPOINT %s %s %s 1 0 0 0\nPOINTS %s\nDATA ascii\n' "$2" "$3" "$4" "$points"
        sed 1d "$work/near.csv" | cut -d, -f1-3 | tr , ' '
    } >"$cloud"
    "$voxtile" build "$cloud" -o "$work/$1" --resolution $resolution --max-range 1000 >/dev/null
    "$voxtile" export "$work/$1" -o "$work/$1.csv" >/dev/null
    rm "$cloud"
}

"$voxtile" demo --out "$work/demo" --length 10 --resolution $resolution >/dev/null
mv "$work/demo/map_tiles" "$work/near"
"$voxtile" export "$work/near" -o "$work/near.csv" >/dev/null
points=$(($(wc -l <"$work/near.csv") - 1))
far_map utm 500123.456 4182321.789 57.3
far_map ecef -2694044.21 -4266368.81 3888310.6

for map in near utm ecef; do
    table=$work/$map.csv
    for format in pcd ply; do
        "$voxtile" export "$work/$map" -o "$work/$map.$format" >/dev/null
    done
    "$work/pcl_reader" "$work/$map.pcd" | compare "$table" "$work/$map.pcd" PCL
    "$python" "$here/points.py" pypcd4 "$work/$map.pcd" | compare "$table" "$work/$map.pcd" pypcd4
    "$python" "$here/points.py" plyfile "$work/$map.ply" | compare "$table" "$work/$map.ply" plyfile
    case $map in
    near) origin= ;;
    utm) origin="--origin 500000 4182000 0" ;;
    ecef) origin="--origin -2694000 -4266000 3888000" ;;
    esac
    for format in bt ot; do
        # shellcheck disable=SC2086
        "$voxtile" export "$work/$map" -o "$work/$map.$format" $origin >/dev/null
        "$work/octomap_reader" "$work/$map.$format" 2>/dev/null | compare "$table" "$work/$map.$format" OctoMap --any-order
    done
    [ "${1-}" = --short ] && continue
    for format in pcd ply; do
        /usr/bin/python3 "$here/points.py" open3d "$work/$map.$format" | compare "$table" "$work/$map.$format" Open3D
    done
    # Debian's CloudCompare cannot read .pcd. It stores float32, and shifts distant points by itself.
    QT_QPA_PLATFORM=offscreen timeout 120 CloudCompare -SILENT -NO_TIMESTAMP -C_EXPORT_FMT ASC -PREC 12 -SEP SPACE -AUTO_SAVE OFF \
        -O -GLOBAL_SHIFT AUTO "$work/$map.ply" -SAVE_CLOUDS FILE "$work/read.asc" >"$work/cc.log" 2>&1 || tail -5 "$work/cc.log"
    touch "$work/read.asc"
    compare "$table" "$work/$map.ply" CloudCompare <"$work/read.asc"
    rm "$work/read.asc"
done
"$python" "$here/layers.py" "$voxtile" "$work/layers" "$work/color_octree" || failed=1
exit $failed
