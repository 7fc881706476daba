#!/usr/bin/env bash
# A benchmark of tools/bench.sh; see there for the options.
exec "$(dirname "$0")/../bench.sh" versions "$@"
