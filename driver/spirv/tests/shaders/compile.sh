#!/bin/sh
# Compiles every shader here to SPIR-V, which is checked in beside it, so that tests need no compiler. A test compares
# the two where there is a compiler. What GLSL can't say is written in SPIR-V's assembly (*.spvasm).
set -e
cd "$(dirname "$0")"
for shader in *.comp *.vert *.tesc *.tese *.geom *.frag; do
    glslangValidator --quiet -V --target-env vulkan1.3 -o "$shader.spv" "$shader"
done
for shader in *.spvasm; do
    spirv-as --target-env spv1.5 -o "${shader%.spvasm}.spv" "$shader"
done
