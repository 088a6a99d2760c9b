#version 460
// A pair of tile and Gaussian for each tile that a Gaussian reaches, in the order of depths.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "set.glsl"
#include "tiles.glsl"
layout(local_size_x = 256) in;

void main() {
    uint i = group() * 256u + gl_LocalInvocationID.x;
    if (i >= push.set.counters.at[SEEN] || push.set.counters.at[STORED] == 0u) {
        return;
    }
    uint at = push.set.counts.at[i] + push.set.sums.at[i / BLOCK];
    uint index = push.set.values.at[i], rows = push.set.records.at[index].tiles_y;
    for (uint y = rows & 0xffffu; y <= rows >> 16; y++) {
        uvec2 row = tiles_of_row(index, y);
        for (uint x = row.x; x < row.y && at < push.set.pair_capacity; x++) {
            push.set.pair_keys.at[at] = y * push.set.tiles.x + x;
            push.set.pair_values.at[at] = index;
            at++;
        }
    }
}
