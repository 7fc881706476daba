#!/usr/bin/env bash
# Prints options of cargo that select the packages of crates.io, each behind those that it needs.
set -euo pipefail
for package in voxtile-scratch voxtile voxtile-simulation voxtile-formats voxtile-local voxtile-share voxtile-bucket voxtile-render \
    voxtile-pipeline voxtile-view voxtile-cli; do
    echo "--package $package"
done
