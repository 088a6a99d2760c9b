#!/bin/sh
# Runs OpenGL over zink, Mesa's OpenGL on Vulkan: glxgears draws three gears, each in its colour, in a window of Xvfb.
. "$(dirname "$0")/common.sh"
need glxinfo glxgears import convert
start_xvfb
# zink takes a device of the type CPU only if software is asked for.
export MESA_LOADER_DRIVER_OVERRIDE=zink LIBGL_ALWAYS_SOFTWARE=1
timeout 60 glxinfo -B > "$out/zink.txt" 2> "$out/zink.log" || failed "glxinfo ($out/zink.log)"
grep -q 'renderer string: zink' "$out/zink.txt" || failed "OpenGL isn't zink ($out/zink.txt)"
version=$(sed -n 's/^OpenGL version string: //p' "$out/zink.txt")
glxgears > "$out/glxgears.log" 2>&1 &
gears=$!
trap 'kill $xvfb $gears 2> /dev/null || true' EXIT
sleep "${GAURAST_CLIENTS_WAIT:-4}"
picture zink
kill -0 $gears 2> /dev/null || failed "glxgears ended ($out/glxgears.log)"
# Pixels that are mostly red, green or blue.
part() {
    convert "$out/zink.png" -crop 300x300+0+0 +repage -fx "$1" -format '%[fx:round(mean*w*h)]' info:
}
red=$(part 'u.r > 0.3 && u.g < u.r / 3 && u.b < u.r / 3 ? 1 : 0')
green=$(part 'u.g > 0.3 && u.r < u.g / 3 ? 1 : 0')
blue=$(part 'u.b > 0.3 && u.r < u.b / 1.5 ? 1 : 0')
for pixels in "$red" "$green" "$blue"; do
    [ "$pixels" -gt 2000 ] || failed "a gear is missing: $red red, $green green, $blue blue pixels ($out/zink.png)"
done
echo "zink $version: passed: $red red, $green green and $blue blue pixels"
