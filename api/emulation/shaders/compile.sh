#!/bin/sh
# Compiles every kernel to SPIR-V, which is checked in beside it, so that nothing but a change of a kernel needs the compiler.
# Usage: compile.sh [FOLDER], which is this one by default.
set -e
cd "$(dirname "$0")"
folder=${1:-.}
compile() {
    glslangValidator --quiet -V --target-env vulkan1.3 "$@"
}
for shader in *.comp *.vert *.frag; do
    compile -o "$folder/$shader.spv" "$shader"
done
# Passes with views need a capability.
compile -DVIEWS -o "$folder/tiles_views.vert.spv" tiles.vert
compile -DVIEWS -o "$folder/fetch_views.frag.spv" fetch.frag
compile -DVIEWS -o "$folder/fetch_tested_views.frag.spv" fetch_tested.frag
compile -DRESOLVED -o "$folder/tiles_resolved.vert.spv" tiles.vert
compile -DRESOLVED -DVIEWS -o "$folder/tiles_resolved_views.vert.spv" tiles.vert
compile -DSTENCILS -o "$folder/samples_stencils.comp.spv" samples.comp
