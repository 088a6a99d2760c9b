#version 460
// The number of tiles that each Gaussian reaches, in the order of their depths.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "set.glsl"
#include "tiles.glsl"
layout(local_size_x = 256) in;

void main() {
    uint i = group() * 256u + gl_LocalInvocationID.x;
    if (i >= push.set.counters.at[SEEN]) {
        return;
    }
    uint index = push.set.values.at[i], rows = push.set.records.at[index].tiles_y, count = 0u;
    for (uint y = rows & 0xffffu; y <= rows >> 16; y++) {
        uvec2 row = tiles_of_row(index, y);
        count += row.y - row.x;
    }
    push.set.counts.at[i] = count;
}
