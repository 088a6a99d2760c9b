#!/bin/sh
# Compiles every shader here to SPIR-V, which is checked in beside it, so that the sample needs no compiler.
set -e
cd "$(dirname "$0")"
for shader in *.vert *.frag *.comp; do
    glslangValidator --quiet -V --target-env vulkan1.3 -o "$shader.spv" "$shader"
done
