#!/bin/sh
# Compiles every shader here to SPIR-V, which is checked in beside it, so that the samples need no compiler.
set -e
cd "$(dirname "$0")"
for shader in *.vert *.tesc *.tese *.geom *.frag; do
    glslangValidator --quiet -V --target-env vulkan1.3 -o "$shader.spv" "$shader"
done
