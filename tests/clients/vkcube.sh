#!/bin/sh
# Runs vkcube of vulkan-tools, in C and C++, on X11 over libxcb, and on Wayland under a headless weston: a textured cube
# rotates for a while in a window.
. "$(dirname "$0")/common.sh"
need vkcube import identify
start_xvfb

for program in vkcube vkcubepp; do
    if ! command -v "$program" > /dev/null; then
        echo "$program: ignored: there is no $program"
        continue
    fi
    "$program" --c 200 --suppress_popups > "$out/$program.log" 2>&1 &
    process=$!
    sleep "${GAURAST_CLIENTS_WAIT:-2}"
    picture "$program"
    wait "$process" || failed "$program ($out/$program.log)"
    # A black screen has one colour.
    [ "$(colours "$out/$program.png")" -gt 50 ] || failed "$program shows no cube ($out/$program.png)"
    echo "$program on xcb: passed"
done

if command -v vkcube-wayland > /dev/null && command -v weston > /dev/null; then
    weston --backend=headless-backend.so --use-pixman --socket=gaurast --width=800 --height=600 --idle-time=0 \
        --debug > "$out/weston.log" 2>&1 &
    weston=$!
    trap 'kill $xvfb $weston 2> /dev/null || true' EXIT
    sleep 2
    WAYLAND_DISPLAY=gaurast vkcube-wayland --c 200 --suppress_popups > "$out/vkcube-wayland.log" 2>&1 \
        || failed "vkcube-wayland ($out/vkcube-wayland.log)"
    echo "vkcube-wayland: passed"
else
    echo "vkcube-wayland: ignored: there is no vkcube-wayland or no weston"
fi
