#version 460
// Sums of all numbers before each in its block, and the blocks' sums.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "set.glsl"
layout(local_size_x = 256) in;
#include "scan.glsl"

void main() {
    uint l = gl_LocalInvocationID.x, block = group(), base = block * BLOCK + l * 8u, count = scanned_count();
    Words data = scanned();
    uint values[8], sum = 0u;
    for (uint j = 0u; j < 8u; j++) {
        values[j] = base + j < count ? data.at[base + j] : 0u;
        sum += values[j];
    }
    uint before = sum_before(sum);
    for (uint j = 0u; j < 8u; j++) {
        if (base + j < count) {
            data.at[base + j] = before;
        }
        before += values[j];
    }
    if (l == 0u && block < blocks(count, BLOCK)) {
        push.set.sums.at[block] = partial[255];
    }
}
