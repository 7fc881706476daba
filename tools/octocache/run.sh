#!/usr/bin/env bash
# The questions of the OctoCache paper, put to voxtile: every table and plot of docs/octocache.md.
#
#   tools/octocache/run.sh [--short] [--only NAME] [--runs N]
#
# --short: look only whether everything works; the page and its folder go below cargo's target folder, and docs/ stays as
# it is. --only: one question (an unknown name lists them). --runs: medians of N runs (3, if nothing else is said). Uses the
# recorded data sets below ${VOXTILE_DATA:-../shared/data}; one that is absent is skipped.
set -euo pipefail
cd "$(dirname "$0")/../.."
target=${CARGO_TARGET_DIR:-target}

cargo build --release --quiet --locked --package octocache
arguments=(--data "${VOXTILE_DATA:-../shared/data}" --page docs/octocache.md)
if [[ " $* " == *" --short "* ]]; then
    mkdir -p "$target/octocache"
    arguments+=(--output "$target/octocache/octocache.md")
fi
exec "$target/release/octocache" "${arguments[@]}" "$@"
