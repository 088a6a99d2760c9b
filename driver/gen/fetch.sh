#!/bin/sh
# Gets the Vulkan registry of the version that registry-gen reads: driver/gen/fetch.sh FOLDER leaves FOLDER/vk.xml.
# registry-gen checks that it is the right file.
set -eu
folder=${1:?a folder to leave vk.xml in}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m pip download --quiet --no-deps --dest "$work" vulkan-object==1.4.366
python3 -m zipfile -e "$work"/vulkan_object-*.whl "$work"
mkdir -p "$folder"
cp "$work/vulkan_object/vk.xml" "$folder/vk.xml"
