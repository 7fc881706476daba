#!/usr/bin/env bash
# Tests the page in a real browser: it shows the map, clicks match `voxtile query`, and it follows a build.
#
#   crates/view/page/check/run.sh [CITY_MAP]     CITY_MAP: a large map, to time its first frame
#
# Needs node and Chromium (CHROMIUM names the program). VOXTILE_BIN is a folder of existing programs.
set -euo pipefail
cd "$(dirname "$0")/../../../.."
target=${CARGO_TARGET_DIR:-target}
[[ -n ${VOXTILE_BIN-} ]] || cargo build --release --quiet --bin voxtile
VOXTILE=$(realpath "${VOXTILE_BIN:-$target/release}/voxtile") node crates/view/page/check/run.mjs "$@"
