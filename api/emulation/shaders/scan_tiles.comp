#version 460
// The number of tiles that the Gaussians before each reach, in the order of their depths and within its block; the blocks' sums.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "set.glsl"
const uint INVOCATIONS = 256u;
layout(local_size_x = INVOCATIONS) in;
#include "scan.glsl"

void main() {
    uint block = group(), base = block * BLOCK + gl_LocalInvocationIndex * 8u, count = push.set.counters.at[SEEN], all;
    Words sorted = push.set.values, reached = push.set.reached, before_each = push.set.before_each;
    uint values[8], sum = 0u;
    for (uint j = 0u; j < 8u; j++) {
        values[j] = base + j < count ? reached.at[sorted.at[base + j]] : 0u;
        sum += values[j];
    }
    uint before = sum_before(sum, all);
    for (uint j = 0u; j < 8u; j++) {
        if (base + j < count) {
            before_each.at[base + j] = before;
        }
        before += values[j];
    }
    if (gl_LocalInvocationIndex == 0u && block < blocks(count, BLOCK)) {
        push.set.sums.at[block] = all;
    }
}
