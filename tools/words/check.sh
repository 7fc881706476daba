#!/usr/bin/env bash
# Typos in all files, by `typos` of PyPI, and words of tools/words/words.tsv.
set -euo pipefail
cd "$(dirname "$0")/../.."
python3 tools/words/check.py
if ! command -v typos >/dev/null; then
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT
    python3 -m venv "$work/venv"
    if ! "$work/venv/bin/pip" install --quiet --disable-pip-version-check 'typos==1.52.0'; then
        echo "skipped: typos cannot be installed"
        exit 0
    fi
    PATH=$work/venv/bin:$PATH
fi
typos
