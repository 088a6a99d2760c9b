#!/usr/bin/env bash
# Runs the Python package's tests on built files: run.sh BUILD, such as target/checked.
#
# The package is laid out in a folder of its own, as a wheel would be. With GAURAST_TEST_LONG=1, the tests also take programs with
# mujoco and wgpu from PyPI, jax's and torch's arrays, and more draws. torch and its libraries take 6 GB.
set -euo pipefail
build=$(realpath "$1")
here=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python=${PYTHON:-python3}
"$python" -m venv "$work/venv"
packages=(numpy pytest mypy)
if [ -n "${GAURAST_TEST_DATA:-}" ]; then packages+=(OpenEXR); fi
if [ -n "${GAURAST_TEST_LONG:-}" ]; then packages+=(mujoco wgpu jax torch); fi
if ! "$work/venv/bin/pip" install --quiet "${packages[@]}"; then
    echo "SKIPPED [1] api/python: ${packages[*]} can't be had"
    [ -z "${GAURAST_TEST_REQUIRE:-}" ]
    exit
fi
cp -r "$here/python" "$work/package"
cp "$build/lib_gaurast.so" "$work/package/gaurast/_gaurast.abi3.so"
"$work/venv/bin/python" -c 'import sys, pathlib; sys.path.insert(0, sys.argv[1]); import backend
backend.collect(pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3]))' "$here" "$build" "$work/package/gaurast"
GAURAST_BUILD=$build PYTHONPATH=$work/package PYTHONDONTWRITEBYTECODE=1 "$work/venv/bin/python" -m pytest -p no:cacheprovider "$here/tests" -rs --durations=5
