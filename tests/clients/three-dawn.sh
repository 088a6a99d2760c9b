#!/bin/sh
# Runs three.js' WebGPURenderer without a browser, by Dawn.
. "$(dirname "$0")/common.sh"
node_packages webgpu@0.6.2 three@0.187.0
check 0.187.0 node "$here/programs/three_dawn.mjs" "$modules"
