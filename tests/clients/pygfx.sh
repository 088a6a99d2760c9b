#!/bin/sh
# Runs pygfx: a lit, textured scene with text, rendered offscreen.
. "$(dirname "$0")/common.sh"
python_packages pygfx==0.17.0 wgpu==0.32.0 numpy==2.3.5 pillow==12.0.0
check 0.17.0 "$python" "$here/programs/pygfx_scene.py" "$out/pygfx.png"
