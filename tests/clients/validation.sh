#!/bin/sh
# Runs vkcube under the Khronos validation layer: no value that the driver reports may cause a message.
# tests/vulkan/initialization/loaded_draws.rs checks the layer's messages about the Gaussian extension, which it does not know.
. "$(dirname "$0")/common.sh"
need vkcube
layer=/usr/share/vulkan/explicit_layer.d/VkLayer_khronos_validation.json
[ -e "$layer" ] || ignored "there is no $layer"
start_xvfb
VK_INSTANCE_LAYERS=VK_LAYER_KHRONOS_validation vkcube --c 30 --suppress_popups > "$out/validation.log" 2>&1 \
    || failed "vkcube ($out/validation.log)"
if grep -q 'VUID\|UNASSIGNED\|Validation Error' "$out/validation.log"; then
    failed "the layer complains ($out/validation.log)"
fi
echo "validation: passed"
