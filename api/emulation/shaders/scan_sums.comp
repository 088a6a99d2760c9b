#version 460
// The blocks' sums become sums of all blocks before, and the sum of all is a count of what follows.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "set.glsl"
layout(local_size_x = 256) in;
#include "scan.glsl"

void main() {
    uint l = gl_LocalInvocationID.x, count = blocks(scanned_count(), BLOCK), all = 0u;
    Words sums = push.set.sums;
    for (uint first = 0u; first < count; first += BLOCK) {
        uint base = first + l * 8u, values[8], sum = 0u;
        for (uint j = 0u; j < 8u; j++) {
            values[j] = base + j < count ? sums.at[base + j] : 0u;
            sum += values[j];
        }
        uint before = all + sum_before(sum);
        for (uint j = 0u; j < 8u; j++) {
            if (base + j < count) {
                sums.at[base + j] = before;
            }
            before += values[j];
        }
        all += partial[255];
        barrier();
    }
    if (l != 0u) {
        return;
    }
    Words counters = push.set.counters;
    if (push.sort == 0u && push.is_first != 0u) {
        counters.at[SEEN] = all;
        set_groups(counters, BY_SEEN, blocks(all, 256u));
        set_groups(counters, SORT_SEEN, blocks(all, BLOCK));
        set_groups(counters, SCAN_SEEN, blocks(256u * blocks(all, BLOCK), BLOCK));
        set_groups(counters, SCAN_COUNTS, blocks(all, BLOCK));
    }
    if (push.sort == 2u) {
        // What does not fit is not sorted by tile: the rasterizer then looks at all Gaussians.
        uint stored = all <= push.set.pair_capacity ? all : 0u;
        counters.at[PAIRS] = all;
        counters.at[STORED] = stored;
        set_groups(counters, BY_PAIR, blocks(stored, 256u));
        set_groups(counters, SORT_PAIRS, blocks(stored, BLOCK));
        set_groups(counters, SCAN_PAIRS, blocks(256u * blocks(stored, BLOCK), BLOCK));
        push.set.feedback.at[0] = max(push.set.feedback.at[0], all);
    }
}
