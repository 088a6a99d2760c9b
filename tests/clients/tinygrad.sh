#!/bin/sh
# Runs tinygrad, whose WEBGPU device is Dawn on Vulkan: a matrix product, a softmax, a convolution, a running sum and sorted numbers.
. "$(dirname "$0")/common.sh"
python_packages tinygrad==0.14.0 dawn-python==0.3.0 numpy==2.4.6
WEBGPU_PATH=$("$python" -c 'import importlib.util, pathlib
print(pathlib.Path(importlib.util.find_spec("pydawn").origin).parent / "lib/libwebgpu_dawn_x86_64.so")')
DEV=WEBGPU
export DEV WEBGPU_PATH
check 0.14.0 "$python" "$here/programs/tinygrad_kernels.py"
