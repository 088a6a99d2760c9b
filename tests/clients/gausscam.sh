#!/bin/sh
# Runs gausscam: its WebGPU rasterizer draws the scenes of tests/compliance that it can, whose pictures are compared with the exact ones.
. "$(dirname "$0")/common.sh"
python_packages gausscam==0.1.5 wgpu==0.32.0 numpy==2.3.5 pillow==12.0.0
check 0.1.5 "$python" "$here/programs/gausscam_scenes.py" "$out/gausscam"
