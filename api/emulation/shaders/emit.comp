#version 460
// A pair of tile and Gaussian for each tile that a Gaussian reaches, in the order of depths.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "set.glsl"
#include "tiles.glsl"
layout(local_size_x = 256) in;

void main() {
    uint i = group() * 256u + gl_LocalInvocationIndex;
    if (i >= push.set.counters.at[SEEN] || push.set.counters.at[STORED] == 0u) {
        return;
    }
    uint at = push.set.before_each.at[i] + push.set.sums.at[i / BLOCK], index = push.set.values.at[i];
    Words keys = push.set.pair_keys, values = push.set.pair_values;
    uint capacity = push.set.pair_capacity, across = push.set.tiles.x;
    Record r = push.set.records.at[index];
    uint count = copies();
    for (uint copy = 0u; copy < count; copy++) {
        Reach reach = reach_of(r, copy);
        for (uint y = reach.tiles_y & 0xffffu; y <= reach.tiles_y >> 16; y++) {
            uvec2 row = tiles_of_row(reach, y, across);
            for (uint x = row.x; x < row.y && at < capacity; x++) {
                keys.at[at] = y * across + x;
                values.at[at] = index | copy << COPY_SHIFT;
                at++;
            }
        }
    }
}
