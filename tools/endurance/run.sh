#!/usr/bin/env bash
# How the out-of-core mapper behaves over distance: every table and plot of docs/endurance.md.
#
#   tools/endurance/run.sh [--short] [--only NAME] [--runs N] [--json FILE]
#
# --short: look only at what does not depend on time: peaks of memory, digests, bytes written, idleness, on small maps; the
# page and its folder go below cargo's target folder, and docs/ stays as it is. --only: one question (an unknown name lists
# them). --runs: medians of N runs (1, if nothing else is said) where speeds are compared. --json: everything, scan by
# scan. Uses a recorded data set below ${VOXTILE_DATA:-../shared/data}; where it is absent, it is skipped. Exits with 1 if
# a promise is broken that does not depend on time.
set -euo pipefail
cd "$(dirname "$0")/../.."
target=${CARGO_TARGET_DIR:-target}

cargo build --release --quiet --locked --package voxtile --package endurance
mkdir -p "$target/endurance"
# Maps lie beside the program: /tmp may be memory.
arguments=(--data "${VOXTILE_DATA:-../shared/data}" --page docs/endurance.md --work "$target/endurance/work")
if [[ " $* " == *" --short "* ]]; then
    arguments+=(--output "$target/endurance/endurance.md")
fi
exec "$target/release/endurance" "${arguments[@]}" "$@"
