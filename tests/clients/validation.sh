#!/bin/sh
# The Khronos validation layer over vkcube and over this project's viewer: no message is caused by a value that the driver
# reports. What it says of the Gaussian extension, which it doesn't know, is held by tests/driver/loader_door.rs.
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
