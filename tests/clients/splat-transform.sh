#!/bin/sh
# Runs PlayCanvas' splat-transform: its WebGPU rasterizer renders a scene of three Gaussians whose pixels are known, and
# GAURAST_TEST_DATA's skull, if that is set, for a look.
. "$(dirname "$0")/common.sh"
node_packages @playcanvas/splat-transform@3.7.0
python_packages pillow==12.0.0
transform=$modules/@playcanvas/splat-transform/bin/cli.mjs
"$python" "$here/programs/three_gaussians.py" write "$out/three.ply"
timeout 300 node "$transform" -w "$out/three.ply" --camera-pos 0,0,-4 --camera-target 0,0,0 --camera-fov 60 \
    --resolution 256x256 "$out/three.webp" > "$out/$client.log" 2>&1 || failed "it renders nothing ($out/$client.log)"
if [ -e "${GAURAST_TEST_DATA:-}/splats/skull.ply" ]; then
    timeout 500 node "$transform" -w "$GAURAST_TEST_DATA/splats/skull.ply" --camera-pos 0,0.5,-3.5 \
        --resolution 1280x720 "$out/skull.webp" >> "$out/$client.log" 2>&1 || failed "it doesn't render the skull"
fi
check 3.7.0 "$python" "$here/programs/three_gaussians.py" check "$out/three.webp"
