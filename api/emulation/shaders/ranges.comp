#version 460
// First and end of each tile's pairs.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "set.glsl"
layout(local_size_x = 256) in;

void main() {
    uint i = group() * 256u + gl_LocalInvocationIndex, count = push.set.counters.at[STORED];
    if (i >= count) {
        return;
    }
    Words keys = push.set.pair_keys;
    Couples ranges = push.set.ranges;
    uint from = push.side == 0u ? 0u : push.set.pair_capacity, key = keys.at[from + i];
    if (i == 0u || keys.at[from + i - 1u] != key) {
        ranges.at[key].x = i;
    }
    if (i + 1u == count || keys.at[from + i + 1u] != key) {
        ranges.at[key].y = i + 1u;
    }
}
