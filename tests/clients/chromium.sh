#!/bin/sh
# Runs Chromium, whose ANGLE draws WebGL 2 by Vulkan: numbers of WebGL, a scene of three.js and one of Spark beside SwiftShader's pictures.
. "$(dirname "$0")/common.sh"
need chromium
# The package's script prints a warning before the version.
version=$(chromium --version 2> /dev/null | sed 's/^Chromium \([0-9.]*\).*/\1/')
node_packages playwright-core@1.64.1 three@0.187.0 @sparkjsdev/spark@2.2.0
if [ -z "${GAURAST_CLIENTS_DRIVER:-}" ]; then
    DEVICE=GauRast
    export DEVICE
fi
CHROMIUM=$(command -v chromium)
export CHROMIUM
check "$version" node "$here/programs/chromium.mjs" "$modules" "$out"
