#!/usr/bin/env bash
# Unpacks an archive of a release, sets the variables of the Vulkan loader for the steps that follow, and proves by vulkaninfo that
# the loader finds the driver.
#
#   setup.sh ARCHIVE        a file or an address, with its .sha256 beside it
#
# RUNNER_TEMP, GITHUB_ENV, GITHUB_PATH and GITHUB_OUTPUT are the runner's.
set -euo pipefail
archive=$1
folder=$RUNNER_TEMP/gaurast
mkdir -p "$folder"
case $archive in
https://*) (cd "$folder" && curl --fail --silent --show-error --location --remote-name-all "$archive" "$archive.sha256") ;;
*) cp "$archive" "$archive.sha256" "$folder" ;;
esac
(cd "$folder" && sha256sum --check --quiet "$(basename "$archive").sha256")
# Images of containers may lack either.
if ! command -v vulkaninfo >/dev/null || ! command -v xz >/dev/null; then
    sudo=$([ "$(id -u)" = 0 ] || echo sudo)
    $sudo apt-get update -qq
    $sudo apt-get install -y -qq --no-install-recommends libvulkan1 vulkan-tools xz-utils >/dev/null
fi
tar -C "$folder" --strip-components=1 -xf "$folder/$(basename "$archive")"
variables=$("$folder/bin/gaurast" icd)
eval "$variables"
for name in VK_DRIVER_FILES VK_ICD_FILENAMES VK_ADD_LAYER_PATH; do
    echo "$name=${!name}" >>"$GITHUB_ENV"
done
echo "$folder/bin" >>"$GITHUB_PATH"
echo "icd=$VK_DRIVER_FILES" >>"$GITHUB_OUTPUT"
found=$(vulkaninfo --summary)
if ! grep -q 'deviceName.*GauRast' <<<"$found"; then
    echo "the Vulkan loader does not find the driver:" >&2
    echo "$found" >&2
    exit 1
fi
grep 'deviceName' <<<"$found"
