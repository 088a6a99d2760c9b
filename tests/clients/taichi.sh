#!/bin/sh
# Runs taichi on its Vulkan backend: fields, atomics and a reduction, compared with numpy.
. "$(dirname "$0")/common.sh"
python_packages taichi==1.7.4 numpy==2.3.5
check 1.7.4 "$python" "$here/programs/taichi_kernels.py"
