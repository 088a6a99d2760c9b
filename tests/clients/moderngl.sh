#!/bin/sh
# Runs OpenGL over zink by moderngl: a compute shader, transform feedback, tessellation and textures, compared with numpy.
. "$(dirname "$0")/common.sh"
python_packages moderngl==5.13.0 numpy==2.3.5
ldconfig -p | grep -q 'libEGL\.so' || ignored "there is no libEGL"
# zink takes a device of the type CPU only if software is asked for.
export MESA_LOADER_DRIVER_OVERRIDE=zink LIBGL_ALWAYS_SOFTWARE=1 EGL_PLATFORM=surfaceless
check 5.13.0 "$python" "$here/programs/moderngl_pipeline.py"
