#!/bin/sh
# Runs slangpy: a Slang function over arrays and a compute kernel, compared with numpy.
. "$(dirname "$0")/common.sh"
python_packages slangpy==0.43.1 numpy==2.3.5
check 0.43.1 "$python" "$here/programs/slangpy_kernels.py"
