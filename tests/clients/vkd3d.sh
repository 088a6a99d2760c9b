#!/bin/sh
# Runs vkd3d's demos, which draw by Direct3D 12 on Vulkan: three gears, and a triangle's colours.
. "$(dirname "$0")/common.sh"
need vkd3d-gears vkd3d-triangle import identify convert
start_xvfb

for program in vkd3d-gears vkd3d-triangle; do
    "$program" > "$out/$program.log" 2>&1 &
    process=$!
    sleep "${GAURAST_CLIENTS_WAIT:-3}"
    picture "$program"
    kill "$process" || failed "$program has ended ($out/$program.log)"
    wait "$process" 2> /dev/null || true
done

# Each gear has a hue of its own, in many shades.
[ "$(colours "$out/vkd3d-gears.png")" -gt 50 ] || failed "vkd3d-gears shows no gears ($out/vkd3d-gears.png)"

# byte X Y CHANNEL: a channel of a pixel of the triangle, 0 to 255.
byte() {
    convert "$out/vkd3d-triangle.png" -format "%[fx:round(255*p{$1,$2}.$3)]" info:
}

# The colours at the corners are red, green and blue; the centroid has a third of each.
for channel in r g b; do
    value=$(byte 320 266 "$channel")
    if [ "$value" -lt 82 ] || [ "$value" -gt 88 ]; then
        failed "vkd3d-triangle has $value of 255 in channel $channel at the centroid ($out/vkd3d-triangle.png)"
    fi
done
[ "$(byte 20 20 r) $(byte 20 20 g) $(byte 20 20 b)" = "0 51 102" ] || failed "vkd3d-triangle's background ($out/vkd3d-triangle.png)"
echo "vkd3d: passed: $(colours "$out/vkd3d-gears.png") colours of gears, the triangle's centroid within 3 of 255"
