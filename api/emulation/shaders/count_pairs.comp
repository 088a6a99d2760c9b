#version 460
// The blocks' sums of tiles become sums of all blocks before, and the sum of all is the number of pairs.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "set.glsl"
const uint INVOCATIONS = 256u;
layout(local_size_x = INVOCATIONS) in;
#include "scan.glsl"

void main() {
    uint l = gl_LocalInvocationIndex, pairs = 0u;
    Words counters = push.set.counters, sums = push.set.sums;
    uint count = blocks(counters.at[SEEN], BLOCK);
    for (uint first = 0u; first < count; first += INVOCATIONS) {
        uint i = first + l, all;
        uint own = i < count ? sums.at[i] : 0u;
        uint before = pairs + sum_before(own, all);
        if (i < count) {
            sums.at[i] = before;
        }
        pairs += all;
    }
    if (l != 0u) {
        return;
    }
    // What does not fit is not sorted by tile: the rasterizer then looks at all Gaussians.
    uint stored = pairs <= push.set.pair_capacity ? pairs : 0u;
    counters.at[PAIRS] = pairs;
    counters.at[STORED] = stored;
    set_groups(counters, BY_PAIR, blocks(stored, 256u));
    set_groups(counters, SORT_PAIRS, blocks(stored, BLOCK));
    push.set.feedback.at[0] = max(push.set.feedback.at[0], pairs);
}
