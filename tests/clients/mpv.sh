#!/bin/sh
# Runs mpv, whose gpu-next shows a video by Vulkan: a frame in a window, against the same frame by ffmpeg on the processor.
. "$(dirname "$0")/common.sh"
need mpv ffmpeg import compare convert
start_xvfb
clip=$out/clip.mkv
frame=$out/mpv-frame.png
# The colours change slowly from pixel to pixel, so that filters of chroma agree.
ffmpeg -v error -y -f lavfi -i "gradients=size=640x360:rate=10:duration=2:seed=7:speed=0.02" -c:v ffv1 -pix_fmt yuv420p "$clip" \
    2> "$out/mpv-clip.log" || ignored "ffmpeg makes no clip ($out/mpv-clip.log)"
ffmpeg -v error -y -ss 1 -i "$clip" -frames:v 1 "$frame"

# mpv takes no processor for a GPU.
GAURAST_DEVICE_TYPE=discrete mpv --no-config --vo=gpu-next --gpu-api=vulkan --gpu-context=x11vk --dither-depth=no --ao=null \
    --geometry=640x360+0+0 --no-border --osc=no --osd-level=0 --start=1 --pause "$clip" > "$out/mpv.log" 2>&1 &
process=$!
trap 'kill $xvfb $process 2> /dev/null || true' EXIT
sleep "${GAURAST_CLIENTS_WAIT:-15}"
picture mpv
kill "$process" 2> /dev/null || failed "mpv has ended ($out/mpv.log)"
convert "$out/mpv.png" -crop 640x360+0+0 +repage "$out/mpv-window.png"
decibels=$(compare -metric PSNR "$out/mpv-window.png" "$frame" null: 2>&1 || true)
# Equal pictures are infinitely near.
[ "$(echo "$decibels" | sed 's/inf.*/999/; s/[. ].*//')" -ge 40 ] || failed "mpv's frame differs from ffmpeg's: $decibels dB ($out/mpv-window.png)"
echo "$(mpv --version | sed -n '1s/^\(mpv [0-9.]*\).*/\1/p'): passed: $decibels dB against ffmpeg's frame"
