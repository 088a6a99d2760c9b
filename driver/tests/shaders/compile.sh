#!/bin/sh
# Compiles every shader here to SPIR-V, which is checked in beside it, so that tests need no compiler.
set -e
cd "$(dirname "$0")"
for shader in *.comp; do
    glslangValidator --quiet --target-env vulkan1.1 -o "$shader.spv" "$shader"
done
