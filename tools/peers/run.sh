#!/usr/bin/env bash
# voxtile beside OctoMap on the same scans: speed, memory and exactness, one table in Markdown.
#
#   tools/peers/run.sh [--short] [--runs N] [--real]
#
# --short: few scans of two workloads, one run. --runs: medians of N runs (3, if nothing else is said). --real: the real
# data sets below ${VOXTILE_DATA:-../shared/data} too; one that is absent is skipped. Exits with 1 if voxtile differs from
# the naive map in any voxel, or OctoMap in more than one of a
# thousand (of a hundred where every ray counts).
set -euo pipefail
cd "$(dirname "$0")/../.."
target=${CARGO_TARGET_DIR:-target}

missing=()
command -v g++ >/dev/null || missing+=(g++)
headers=(/usr/include/octomap/octomap.h /usr/local/include/octomap/octomap.h)
[[ -e ${headers[0]} || -e ${headers[1]} ]] || missing+=(liboctomap-dev)
if [[ ${#missing[@]} -gt 0 ]]; then
    echo "peers: missing; install with: apt-get install ${missing[*]}" >&2
    exit 2
fi
version=$(dpkg-query -W -f '${Version}' liboctomap-dev 2>/dev/null) || version="of unknown version"

cargo build --release --quiet --locked --package peers
mkdir -p "$target/peers"

# Without contracted operations, like Debian's library: fused multiply-add visits slightly other voxels. OctoMap's
# headers hold the ray walk and the insertion, so both are compiled here, not only in the library.
compile() { # program, options
    local program=$target/peers/$1
    shift
    g++ -std=c++17 "$@" -DNDEBUG -ffp-contract=off -Wall -o "$program" tools/peers/octomap_contender.cpp \
        -loctomap -loctomath
}
contenders=(--voxtile "$target/release/voxtile_contender" --octomap "$target/peers/octomap")
compile octomap -O2
if [[ " $* " != *" --short "* ]]; then
    compile octomap_native -O3 -march=native
    contenders+=(--octomap-native "$target/peers/octomap_native")
fi

# Streams and maps lie beside the programs: /tmp may be memory.
exec "$target/release/peers" "${contenders[@]}" --octomap-version "$version" --work "$target/peers/work" \
    --data "${VOXTILE_DATA:-../shared/data}" "$@"
