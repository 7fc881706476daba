#!/usr/bin/env bash
# Checks maps in a bucket against separate servers: moto (from PyPI) as S3, and a plain web server.
#
#   tools/bucket/check.sh        VOXTILE_BIN: folder of a voxtile with the feature `bucket`
#
# Installs moto into a virtual environment unless VOXTILE_MOTO_PYTHON names a Python that has it.
set -euo pipefail
cd "$(dirname "$0")/../.."
bin=${VOXTILE_BIN:-target/debug}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python=${VOXTILE_MOTO_PYTHON:-}
if [[ -z $python ]]; then
    python3 -m venv "$work/venv"
    "$work/venv/bin/pip" install --quiet 'moto[s3,server]==5.2.5'
    python=$work/venv/bin/python
fi
"$bin/voxtile" demo --out "$work/demo" --length 60 --quiet >/dev/null
"$python" tools/bucket/check.py "$bin/voxtile" "$work/demo/map_tiles" "$work"
