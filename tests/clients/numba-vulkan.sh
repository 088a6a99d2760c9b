#!/bin/sh
# Runs kernels in Python that numba-vulkan compiles by LLVM's SPIR-V backend: a Mandelbrot set, and elementary functions.
. "$(dirname "$0")/common.sh"
python_packages numba-vulkan==0.1.0 numba==0.68.1 llvmlite==0.50.0 vulkan==1.3.275.1 numpy==2.4.6
check 0.1.0 "$python" "$here/programs/numba_kernels.py"
