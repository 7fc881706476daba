#!/usr/bin/env bash
# Compares M3C2 with `voxtile compare` on simulated epochs: the tables of docs/measurements/compare.md.
#
#   tools/m3c2/run.sh
#
# Installs py4dgeo and OccPy from PyPI into a virtual environment of its own; takes some minutes. VOXTILE is a built
# program (default: a release build).
set -euo pipefail
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check numpy py4dgeo occpy-ls
if [ -z "${VOXTILE:-}" ]; then
    cargo build --release --locked -p voxtile-cli
    VOXTILE=${CARGO_TARGET_DIR:-target}/release/voxtile
fi
export VOXTILE_EPOCHS=$work/epochs
cargo test --quiet --locked -p voxtile-compare --test compare epochs_are_written -- --ignored
program=$(realpath "$VOXTILE") script=$(realpath tools/m3c2/epochs.py)
# The libraries write logs into the current folder.
cd "$work"
venv/bin/python "$script" epochs "$program"
