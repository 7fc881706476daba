#!/bin/sh
# Other programs read what voxtile-formats writes: every format is read back with somebody else's library, and every voxel
# must come back to its index exactly; near the origin, around UTM coordinates, and with indices that reach that far.
#
#   tools/interchange/formats.sh
#
# Needs python3 with venv; its packages, and those of npm where node is there, go to a temporary folder. VOXTILE_BIN is a
# folder with a built `write_voxels`. Exits with 1 if a comparison fails.
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
    mcap-ros2-support trimesh scipy

if command -v node >/dev/null && command -v npm >/dev/null; then
    (cd "$work" && npm init --yes >/dev/null && npm install --silent --no-audit --no-fund gltf-validator copc >/dev/null)
    cp "$here/formats.mjs" "$work/formats.mjs"
    npm="--npm $work/formats.mjs"
else
    echo "npm is not there: gltf-validator and copc are skipped"
    npm=
fi
# shellcheck disable=SC2086
"$work/venv/bin/python" "$here/formats.py" "$VOXTILE_BIN/write_voxels" "$work" $npm
