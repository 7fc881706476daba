#!/usr/bin/env bash
# Builds the Python package, installs it into an empty environment, and tests it there: behaviour, guide, notebooks,
# types, stubs.
#
#   python/check.sh [--short] [PYTEST ARGUMENTS]
#
# --short leaves out clusters of Dask, the notebooks and pyright, whose three minutes guard what seldom changes, and takes
# the module that `cargo build --workspace --features voxtile-python/extension-module` has made, from VOXTILE_BIN: a
# wheel has other features, with which half of the dependencies would compile once more.
#
# Needs python3 with venv, and the network for maturin, pytest, mypy and the like. The build is that of the tests, which
# is made in a few minutes; `maturin build --release` makes the wheel to hand out.
set -euo pipefail
cd "$(dirname "$0")"
short=
if [[ ${1:-} == --short ]]; then short=1 && shift; fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
python=$work/venv/bin/python
install() { "$python" -m pip install --quiet --disable-pip-version-check "$@"; }
install dask distributed matplotlib mypy pytest
left_out=()
if [[ $short ]]; then
    for file in dask dask_jobs dask_pieces notebooks; do left_out+=("--ignore=tests/test_$file.py"); done
else
    install ipykernel nbclient pyright
fi
install --only-binary :all: pyoctomap || echo "skipped: pyoctomap, which has no wheel for this Python"
if [[ $short ]]; then
    module=$(realpath "${VOXTILE_BIN:-../target/debug}")/lib_voxtile.so
    package=$("$python" -c 'import sysconfig; print(sysconfig.get_path("platlib"))')/voxtile
    install 'numpy>=1.24'
    cp -r python/voxtile "$package"
    cp "$module" "$package/_voxtile.abi3.so"
    printf '#!%s\nfrom voxtile.__main__ import main\nmain()\n' "$python" >"$work/venv/bin/voxtile"
    chmod +x "$work/venv/bin/voxtile"
else
    CARGO_PROFILE_DEV_OPT_LEVEL=1 MATURIN_PEP517_ARGS="--profile dev --locked" install .
fi
# Beside the sources, Python would find the package without its module.
cp -r tests "$work/tests"
cp -r examples "$work/examples"
mkdir "$work/docs"
cp ../docs/python.md ../docs/python_recorded.md "$work/docs"
# Tests run elsewhere, where a relative path leads nowhere.
VOXTILE_DATA=$(realpath -m "${VOXTILE_DATA:-../../shared/data}")
export VOXTILE_DATA
mkdir "$work/python"
mv "$work/tests" "$work/examples" "$work/python"
cd "$work/python"
"$python" -m pytest --quiet tests "${left_out[@]}" "$@"
"$python" -m mypy --strict --package voxtile
"$python" -m mypy.stubtest voxtile
# It gets its program from npm.
if [[ $short ]]; then
    echo "left out: pyright"
elif "$python" -m pyright --version >/dev/null 2>&1; then
    "$python" -m pyright --pythonpath "$python" "$("$python" -c 'import os, voxtile; print(os.path.dirname(voxtile.__file__))')"
else
    echo "skipped: pyright, whose program is not to be had"
fi
"$python" -c '
import pathlib, subprocess, sys, voxtile
began = "import time; began = time.perf_counter(); import numpy; between = time.perf_counter(); import voxtile; "
took = subprocess.check_output([sys.executable, "-c", began + "print(round(1e3 * (time.perf_counter() - between)))"])
size = next(pathlib.Path(voxtile.__file__).parent.glob("_voxtile*.so")).stat().st_size
print(f"module: {size / 1e6:.1f} MB; import after numpy: {int(took)} ms")
'
