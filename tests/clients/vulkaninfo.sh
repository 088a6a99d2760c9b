#!/bin/sh
# Runs vulkaninfo of vulkan-tools: it makes all queries, also of X11 surfaces, and finds one device of version 1.3.
. "$(dirname "$0")/common.sh"
need vulkaninfo
start_xvfb
vulkaninfo --summary > "$out/summary.txt" 2> "$out/summary.log" || failed "vulkaninfo --summary ($out/summary.log)"
[ "$(grep -c 'deviceName' "$out/summary.txt")" = 1 ] || failed "it lists not one device"
grep -q 'apiVersion *= .*1\.3\.' "$out/summary.txt" || failed "the device is not of version 1.3"
vulkaninfo > "$out/vulkaninfo.txt" 2> "$out/vulkaninfo.log" || failed "vulkaninfo ($out/vulkaninfo.log)"
for name in VK_KHR_xcb_surface VK_KHR_xlib_surface VK_KHR_wayland_surface VK_KHR_swapchain; do
    grep -q "$name" "$out/vulkaninfo.txt" || failed "it doesn't list $name"
done
grep -q 'PRESENT_MODE_FIFO_KHR' "$out/vulkaninfo.txt" || failed "it shows no surface"
if grep -qi 'error\|fail' "$out/vulkaninfo.log"; then
    failed "it complains ($out/vulkaninfo.log)"
fi
echo "vulkaninfo: passed"
