#!/bin/sh
# Runs ncnn: a small network on Vulkan and on the processor, in binary32 and binary16.
. "$(dirname "$0")/common.sh"
python_packages ncnn==1.0.20261020 numpy==2.3.5
check 1.0.20261020 "$python" "$here/programs/ncnn_network.py"
