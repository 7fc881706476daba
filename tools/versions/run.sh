#!/usr/bin/env bash
# One of the benchmarks of tools/bench.sh, whose head tells the options.
exec "$(dirname "$0")/../bench.sh" versions "$@"
