#!/bin/sh
# Reads everything that voxtile-formats writes with third-party libraries. Every voxel must be read back exactly at its
# index, near the origin, around UTM coordinates, and with equally large indices.
#
#   tools/interchange/formats.sh
#
# Needs python3 with venv. The Python packages, and npm packages if node is installed, are put into a temporary folder.
# VOXTILE_BIN is a folder with a built `write_voxels`. Exits with 1 if a comparison fails.
set -eu
cd "$(dirname "$0")/../.."
here=tools/interchange
target=${CARGO_TARGET_DIR:-target}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

if [ -z "${VOXTILE_BIN-}" ]; then
    cargo build --quiet --profile test --package voxtile-formats --all-features --example write_voxels
    VOXTILE_BIN=$target/debug/examples
fi

python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check numpy pyyaml pillow 'laspy[lazrs]' pye57 pyarrow mcap \
    mcap-ros2-support rasterio trimesh scipy

if command -v node >/dev/null && command -v npm >/dev/null; then
    (cd "$work" && npm init --yes >/dev/null && npm install --silent --no-audit --no-fund gltf-validator copc >/dev/null)
    cp "$here/formats.mjs" "$work/formats.mjs"
    npm="--npm $work/formats.mjs"
else
    echo "npm is not installed: gltf-validator and copc are skipped"
    npm=
fi
# shellcheck disable=SC2086
"$work/venv/bin/python" "$here/formats.py" "$VOXTILE_BIN/write_voxels" "$work" $npm
