#!/usr/bin/env bash
# Runs the benchmarks:
#
#   tools/bench.sh                     lists them
#   tools/bench.sh NAME [OPTIONS]      runs one; `all` runs all of them, with common options only
#
# Common options: --short (checks only that everything works and leaves docs/ unchanged), --only PART (an unknown name
# lists the parts), --runs N (figures are medians), --out FOLDER (for the results). `tools/bench.sh NAME --help` lists
# the others. Recorded data is read from ${VOXTILE_DATA:-../shared/data}; missing data sets are skipped. A benchmark
# exits with 1 if a check that does not depend on time fails, and with 2 after an error.
set -euo pipefail
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-target}

list() {
    echo "benchmarks, to run with tools/bench.sh NAME:"
    echo "  distance   distance fields compared with edt and scipy, updates, points: docs/measurements/distance.md"
    echo "  endurance  memory, cost of a scan, speed in little memory, over distance: docs/measurements/endurance.md"
    echo "  octocache  the questions of the OctoCache paper: docs/measurements/octocache.md"
    echo "  peers      speed, memory and exactness compared with OctoMap: a table on standard output"
    echo "  static     surfaces kept and movers removed by both rules of clearing, and DUFOMap: docs/measurements/clearing.md"
    echo "  versions   speed compared with an earlier version (--before COMMIT): docs/measurements/versions.md"
}

run() { # package, arguments
    local name=$1
    shift
    "$target/release/$name" --data "${VOXTILE_DATA:-../shared/data}" --target "$target" "$@"
}

endurance() {
    cargo build --release --quiet --locked --package voxtile-cli --package endurance
    run endurance "$@"
}

octocache() {
    cargo build --release --quiet --locked --package octocache
    run octocache "$@"
}

peers() {
    local version contenders
    . tools/peers/octomap.sh
    cargo build --release --quiet --locked --package peers
    octomap_contenders "$@"
    run peers "${contenders[@]}" --octomap-version "$version" "$@"
}

static() { tools/static_map/run.sh "$@"; }

distance() { tools/distance/run.sh "$@"; }

# Builds the programs of both versions, the earlier one from its own checkout.
versions() {
    local options=() commit= source=$target/versions/source
    while [[ $# -gt 0 ]]; do
        case $1 in
        --before) commit=${2:?--before: which commit?} && shift 2 ;;
        *) options+=("$1") && shift ;;
        esac
    done
    [[ -n $commit ]] || { echo "versions: --before COMMIT is required" >&2 && exit 2; }
    cargo build --release --quiet --locked --package voxtile-cli --package peers --package versions
    git worktree remove --force "$source" 2>/dev/null || rm -rf "$source"
    git worktree prune
    git worktree add --quiet --detach "$source" "$commit"
    # Both versions run the same questions.
    cp tools/peers/src/bin/questions.rs "$source/tools/peers/src/bin/"
    local before
    before=$(realpath "$target")/versions/before
    # The earlier version may have the command in another package.
    (cd "$source" && export CARGO_TARGET_DIR=$before && cargo build --release --quiet --locked --workspace --bin voxtile &&
        cargo build --release --quiet --locked --package peers)
    git worktree remove --force "$source"
    run versions --before "$before/release" --now "$target/release" "${options[@]}"
}

name=${1:-}
shift || true
case $name in
"") list ;;
distance | endurance | octocache | peers | static | versions) "$name" "$@" ;;
all)
    failed=()
    for name in endurance octocache peers; do
        # `set -e` stops this separate process at the first error.
        tools/bench.sh "$name" "$@" || failed+=("$name")
    done
    [[ ${#failed[@]} -eq 0 ]] || { echo "bench: failed: ${failed[*]}" >&2 && exit 1; }
    ;;
*)
    echo "bench: no benchmark named $name" >&2
    list >&2
    exit 2
    ;;
esac
