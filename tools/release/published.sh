#!/usr/bin/env bash
# Prints cargo options that select the packages for crates.io, each after its dependencies.
set -euo pipefail
for package in voxtile-scratch voxtile voxtile-simulation voxtile-formats voxtile-local voxtile-monitoring voxtile-share voxtile-bucket voxtile-clean voxtile-compare voxtile-distance voxtile-render \
    voxtile-pipeline voxtile-view voxtile-cli; do
    echo "--package $package"
done
