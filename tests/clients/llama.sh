#!/bin/sh
# Runs llama.cpp's Vulkan device, by npm's node-llama-cpp, on a small model with random weights, and compares it with the processor. It takes no
# processor for a GPU.
. "$(dirname "$0")/common.sh"
# The packages for other devices are large.
npm_config_omit=optional
export npm_config_omit
node_packages node-llama-cpp@3.22.1 @node-llama-cpp/linux-x64@3.22.1 @node-llama-cpp/linux-x64-vulkan@3.22.1
if [ -z "${GAURAST_CLIENTS_DRIVER:-}" ]; then
    DEVICE=GauRast GAURAST_DEVICE_TYPE=discrete
    export DEVICE GAURAST_DEVICE_TYPE
fi
check 3.22.1 node "$here/programs/llama.mjs" "$modules" "$out"
