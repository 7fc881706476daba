#!/usr/bin/env bash
# Fuzzes the readers of all file formats, one after the other, with stable Rust.
#
#   fuzz/run.sh [SECONDS_PER_TARGET] [TARGET...]    default: 60 seconds, all targets
#   fuzz/run.sh minimize [TARGET...]                adds inputs to fuzz/corpus that reach code not reached before
#
# Prints one line per target. A finding writes its input to fuzz/artifacts and makes the exit status 1. The inputs that
# a run discovers are kept in fuzz/target/corpus for the next run.
set -euo pipefail
cd "$(dirname "$0")"

seconds=60
if [[ ${1:-} == minimize || ${1:-} =~ ^[0-9]+$ ]]; then
    seconds=$1
    shift
fi
targets=("$@")
if [[ $# == 0 ]]; then
    for file in src/bin/*.rs; do targets+=("$(basename "$file" .rs)"); done
fi

# With an explicit target triple, cargo does not instrument build scripts and procedural macros.
triple=$(rustc -vV | sed -n 's/^host: //p')
bins=()
for target in "${targets[@]}"; do bins+=(--bin "$target"); done
RUSTFLAGS="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
-Cllvm-args=-sanitizer-coverage-trace-compares --cfg fuzzing" \
    cargo build --release --locked --target "$triple" "${bins[@]}"

# Keeps all named inputs of the corpus (seeds and findings), and adds at most 48 small inputs that reach other code.
minimize() {
    local target=$1 program=$2 kept
    kept=target/minimized
    rm -rf "$kept"
    mkdir "$kept"
    find "corpus/$target" -name '*-*' -exec cp {} "$kept" \;
    "$program" -set_cover_merge=1 -use_counters=0 -max_len=1024 -rss_limit_mb=1024 -timeout=10 \
        "$kept" "corpus/$target" "target/corpus/$target" >"target/$target.log" 2>&1
    # Keep the first 48 files, which cover most code. Files that the fuzzer found are named by 40 digits.
    ls -tr "$kept" | { grep -v -e - || true; } | tail -n +49 | while read -r file; do rm "$kept/$file"; done
    rm -r "corpus/$target"
    mv "$kept" "corpus/$target"
    printf '%-10s %3d files\n' "$target" "$(find "corpus/$target" -type f | wc -l)"
}

fuzz() {
    local target=$1 program=$2 dictionary=() outcome=
    if [[ -e dictionaries/$target.dict ]]; then dictionary=("-dict=dictionaries/$target.dict"); fi
    "$program" -max_total_time="$seconds" -max_len=65536 -timeout=10 -rss_limit_mb=1024 \
        -artifact_prefix="artifacts/$target/" "${dictionary[@]}" \
        "target/corpus/$target" "corpus/$target" >"target/$target.log" 2>&1 || outcome="FINDING (exit status $?), see target/$target.log"
    # The last line with numbers has the totals; runs are printed as `#N`.
    awk -v target="$target" -v outcome="$outcome" '
        /^#[0-9]+/ { runs = substr($1, 2) }
        /cov: / { for (i = 1; i < NF; i++) if ($i == "cov:") edges = $(i + 1) }
        /^Done / { runs = $2; seconds = $5 }
        END { printf "%-10s %10d executions %5d s %6d edges  %s\n", target, runs, seconds, edges, outcome }
    ' "target/$target.log"
    [[ -z $outcome ]]
}

# Targets whose reader takes a path write the input to a temporary file, in memory if possible.
TMPDIR=$(mktemp -d -p /dev/shm 2>/dev/null || mktemp -d)
export TMPDIR
trap 'rm -rf "$TMPDIR"' EXIT

status=0
for target in "${targets[@]}"; do
    mkdir -p "corpus/$target" "target/corpus/$target" "artifacts/$target"
    program=target/$triple/release/$target
    if [[ $seconds == minimize ]]; then
        minimize "$target" "$program"
    else
        fuzz "$target" "$program" || status=1
    fi
done
exit $status
