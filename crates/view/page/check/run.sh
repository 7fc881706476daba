#!/usr/bin/env bash
# The page in a real browser: what it shows is the map, clicks say what `voxtile query` says, and it follows a build.
#
#   crates/view/page/check/run.sh [CITY_MAP]     CITY_MAP: a large map, whose first picture is timed
#
# Needs node and Chromium (CHROMIUM names the program). VOXTILE_BIN is a folder of programs that are built already.
set -euo pipefail
cd "$(dirname "$0")/../../../.."
target=${CARGO_TARGET_DIR:-target}
[[ -n ${VOXTILE_BIN-} ]] || cargo build --release --quiet --bin voxtile
VOXTILE=$(realpath "${VOXTILE_BIN:-$target/release}/voxtile") node crates/view/page/check/run.mjs "$@"
