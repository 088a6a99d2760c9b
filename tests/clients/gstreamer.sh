#!/bin/sh
# Runs GStreamer's Vulkan elements: an upload, a draw that copies or converts, and a download, compared byte for byte with
# what entered, and with videoconvert.
. "$(dirname "$0")/common.sh"
need gst-launch-1.0 gst-inspect-1.0 cmp
gst-inspect-1.0 vulkanupload > "$out/gstreamer.log" 2>&1 || ignored "this GStreamer has no Vulkan elements"
version=$(gst-launch-1.0 --version | sed -n 's/^GStreamer \(.*\)/\1/p')

# frames FILE ELEMENT...: three frames of a test picture pass the elements.
frames() {
    file=$1
    shift
    timeout 60 gst-launch-1.0 -q videotestsrc num-buffers=3 ! video/x-raw,format=BGRA,width=320,height=240 ! "$@" ! \
        filesink location="$file" > "$out/gstreamer.log" 2>&1 || failed "$* ($out/gstreamer.log)"
}

frames "$out/in.raw" identity
frames "$out/identity.raw" vulkanupload ! vulkanimageidentity ! vulkandownload
cmp "$out/in.raw" "$out/identity.raw" || failed "vulkanimageidentity changes frames"
frames "$out/convert.raw" videoconvert ! video/x-raw,format=RGBA
frames "$out/vulkan-convert.raw" vulkanupload ! vulkancolorconvert ! 'video/x-raw(memory:VulkanImage),format=RGBA' ! \
    vulkandownload
cmp "$out/convert.raw" "$out/vulkan-convert.raw" || failed "vulkancolorconvert differs from videoconvert"
echo "gstreamer $version: passed: $(wc -c < "$out/in.raw") bytes are equal, twice"
