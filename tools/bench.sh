#!/usr/bin/env bash
# The benchmarks, one driver for all:
#
#   tools/bench.sh                     lists them
#   tools/bench.sh NAME [OPTIONS]      runs one; `all` runs all, with options that all of them have
#
# Options of all: --short (check only that everything works; docs/ stays as it is), --only PART (an unknown name lists
# the parts), --runs N (figures are medians), --out FOLDER (where results go). `tools/bench.sh NAME --help` lists the
# others. Recorded data comes from below ${VOXTILE_DATA:-../shared/data}; a set that is absent is skipped. A benchmark
# exits with 1 if something is wrong that does not depend on time, with 2 after an error.
set -euo pipefail
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-target}

list() {
    echo "benchmarks, to run with tools/bench.sh NAME:"
    echo "  endurance  memory, cost of a scan, speed in little memory, over distance: docs/measurements/endurance.md"
    echo "  octocache  the questions of the OctoCache paper: docs/measurements/octocache.md"
    echo "  peers      speed, memory and exactness beside OctoMap: a table on standard output"
    echo "  versions   speed beside an earlier version: docs/measurements/versions.md; --before COMMIT names it"
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

# The programs of both versions; the earlier one is built from a checkout of its own.
versions() {
    local options=() commit= source=$target/versions/source
    while [[ $# -gt 0 ]]; do
        case $1 in
        --before) commit=${2:?--before: which commit?} && shift 2 ;;
        *) options+=("$1") && shift ;;
        esac
    done
    [[ -n $commit ]] || { echo "versions: say --before COMMIT" >&2 && exit 2; }
    cargo build --release --quiet --locked --package voxtile-cli --package peers --package versions
    git worktree remove --force "$source" 2>/dev/null || rm -rf "$source"
    git worktree prune
    git worktree add --quiet --detach "$source" "$commit"
    # The same questions are put to both.
    cp tools/peers/src/bin/questions.rs "$source/tools/peers/src/bin/"
    local before
    before=$(realpath "$target")/versions/before
    # Whatever package the command is in there.
    (cd "$source" && export CARGO_TARGET_DIR=$before && cargo build --release --quiet --locked --workspace --bin voxtile &&
        cargo build --release --quiet --locked --package peers)
    git worktree remove --force "$source"
    run versions --before "$before/release" --now "$target/release" "${options[@]}"
}

name=${1:-}
shift || true
case $name in
"") list ;;
endurance | octocache | peers | versions) "$name" "$@" ;;
all)
    failed=()
    for name in endurance octocache peers; do
        # A process of its own: `set -e` stops it at the first error.
        tools/bench.sh "$name" "$@" || failed+=("$name")
    done
    [[ ${#failed[@]} -eq 0 ]] || { echo "bench: failed: ${failed[*]}" >&2 && exit 1; }
    ;;
*)
    echo "bench: there is no benchmark $name" >&2
    list >&2
    exit 2
    ;;
esac
