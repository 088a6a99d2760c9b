#!/bin/sh
# Runs Dawn by npm's webgpu: a compute shader's numbers, and the pixels of a textured draw.
. "$(dirname "$0")/common.sh"
node_packages webgpu@0.6.2
check 0.6.2 node "$here/programs/dawn.mjs" "$modules"
