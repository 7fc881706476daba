#!/usr/bin/env bash
# Builds the Python package, installs it into an empty environment, and tests it there: behaviour, guide, notebooks,
# types, stubs.
#
#   python/check.sh [--short] [PYTEST ARGUMENTS]
#
# --short skips Dask clusters, the notebooks and pyright, which take several minutes and rarely fail. It uses the module
# in VOXTILE_BIN that `cargo build --workspace --features voxtile-python/extension-module` has built, because a wheel
# with other features would recompile half of the dependencies.
#
# Needs python3 with venv, and the network for maturin, pytest, mypy and others. The module is a development build,
# which takes a few minutes; `maturin build --release` builds a wheel for distribution.
set -euo pipefail
cd "$(dirname "$0")"
short=
if [[ ${1:-} == --short ]]; then short=1 && shift; fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
python=$work/venv/bin/python
install() { "$python" -m pip install --quiet --disable-pip-version-check "$@"; }
install dask distributed matplotlib 'moto[s3,server]' mypy pytest
left_out=()
if [[ $short ]]; then
    for file in dask dask_jobs dask_replays dask_shards notebooks; do left_out+=("--ignore=tests/test_$file.py"); done
else
    install ipykernel nbclient pyright
fi
install --only-binary :all: pyoctomap || echo "skipped: pyoctomap has no wheel for this version of Python"
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
# Run the tests in another folder: here, Python would import the source folder, which lacks the compiled module.
cp -r tests "$work/tests"
cp -r examples "$work/examples"
mkdir "$work/docs"
cp ../docs/python.md ../docs/python_recorded.md "$work/docs"
# Tests run in another folder, so the path must be absolute.
VOXTILE_DATA=$(realpath -m "${VOXTILE_DATA:-../../shared/data}")
export VOXTILE_DATA
mkdir "$work/python"
mv "$work/tests" "$work/examples" "$work/python"
cd "$work/python"
"$python" -m pytest --quiet tests "${left_out[@]}" "$@"
"$python" -m mypy --strict --package voxtile
"$python" -m mypy.stubtest voxtile
# Pyright downloads its program from npm.
if [[ $short ]]; then
    echo "skipped: pyright"
elif "$python" -m pyright --version >/dev/null 2>&1; then
    "$python" -m pyright --pythonpath "$python" "$("$python" -c 'import os, voxtile; print(os.path.dirname(voxtile.__file__))')"
else
    echo "skipped: pyright, whose program cannot be downloaded"
fi
"$python" -c '
import pathlib, subprocess, sys, voxtile
began = "import time; began = time.perf_counter(); import numpy; between = time.perf_counter(); import voxtile; "
took = subprocess.check_output([sys.executable, "-c", began + "print(round(1e3 * (time.perf_counter() - between)))"])
size = next(pathlib.Path(voxtile.__file__).parent.glob("_voxtile*.so")).stat().st_size
print(f"module: {size / 1e6:.1f} MB; import after numpy: {int(took)} ms")
'
