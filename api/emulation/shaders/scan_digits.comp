#version 460
// A workgroup is a digit: the numbers of its keys in blocks become those in all blocks before.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "counters.glsl"
#include "sort.glsl"
const uint INVOCATIONS = 64u;
layout(local_size_x = INVOCATIONS) in;
#include "scan.glsl"

void main() {
    uint l = gl_LocalInvocationIndex, digit = gl_WorkGroupID.x, width = blocks(sorted_count(), BLOCK), total = 0u;
    Words histogram = push.histogram;
    for (uint first = 0u; first < width; first += 8u * INVOCATIONS) {
        uint base = first + 8u * l, values[8], sum = 0u, all;
        for (uint j = 0u; j < 8u; j++) {
            values[j] = base + j < width ? histogram.at[digit * width + base + j] : 0u;
            sum += values[j];
        }
        uint before = total + sum_before(sum, all);
        for (uint j = 0u; j < 8u; j++) {
            if (base + j < width) {
                histogram.at[digit * width + base + j] = before;
            }
            before += values[j];
        }
        total += all;
    }
    if (l == 0u) {
        push.totals.at[digit] = total;
    }
}
