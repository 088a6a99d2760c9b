#!/bin/sh
# Runs IREE: a compiled matrix product, convolution and softmax, compared with numpy.
. "$(dirname "$0")/common.sh"
python_packages iree-base-runtime==3.13.0 iree-base-compiler==3.13.0 numpy==2.3.5
check 3.13.0 "$python" "$here/programs/iree_modules.py"
