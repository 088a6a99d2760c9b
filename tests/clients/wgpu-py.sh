#!/bin/sh
# Runs wgpu-py: a compute shader's numbers, and the pixels of a triangle.
. "$(dirname "$0")/common.sh"
python_packages wgpu==0.32.0 numpy==2.3.5
check 0.32.0 "$python" "$here/programs/wgpu_py.py"
