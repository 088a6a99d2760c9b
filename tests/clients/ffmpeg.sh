#!/bin/sh
# Runs ffmpeg's Vulkan filters on frames of one plane, and compares each with an expression that says what it does:
# the filters sample bilinearly at the corners of pixels, so that they average four.
. "$(dirname "$0")/common.sh"
need ffmpeg
ffmpeg -hide_banner -filters 2> "$out/ffmpeg.log" | grep -q hflip_vulkan || ignored "this ffmpeg has no Vulkan filters"
version=$(ffmpeg -version | sed -n '1s/^ffmpeg version \([^ -]*\).*/\1/p')
# Multiples of the filters' workgroups: their barriers lie in branches that other sizes make divergent.
source=testsrc2=size=320x256:rate=5:duration=1,format=gray

# same NAME FILTER EXPRESSION LEAST: the peak signal-to-noise ratio of the two is at least so many decibels.
figures=
same() {
    ffmpeg -hide_banner -v info -init_hw_device vulkan=v:0 -filter_hw_device v -f lavfi -i "$source" -filter_complex \
        "split[a][b];[a]hwupload,$2,hwdownload,format=gray[c];[b]$3,format=gray[d];[c][d]psnr" -f null - \
        > "$out/ffmpeg-$1.log" 2>&1 < /dev/null || failed "$1 ($out/ffmpeg-$1.log)"
    ratio=$(sed -n 's/.*PSNR.* min:\([^ ]*\).*/\1/p' "$out/ffmpeg-$1.log")
    [ -n "$ratio" ] || failed "$1: no figure ($out/ffmpeg-$1.log)"
    case $ratio in
        inf) ;;
        *) [ "${ratio%.*}" -ge "$4" ] || failed "$1: $ratio dB, less than $4" ;;
    esac
    figures="$figures${figures:+, }$1 $ratio"
}

same hflip hflip_vulkan "geq=lum='p(W-X-0.5,Y-0.5)'" 48
same vflip vflip_vulkan "geq=lum='p(X-0.5,H-Y-0.5)'" 48
same flip flip_vulkan "geq=lum='p(W-X-0.5,H-Y-0.5)'" 48
same scale scale_vulkan=w=640:h=512 scale=640:512:flags=bilinear 30
same avgblur avgblur_vulkan "geq=lum='p(X-0.5,Y-0.5)',geq=lum='p(X-0.5,Y-0.5)',avgblur" 30
echo "ffmpeg $version: passed: decibels of $figures"
