#version 460
// The number of keys with each digit, by blocks of keys.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "counters.glsl"
#include "sort.glsl"
layout(local_size_x = 256) in;
shared uint digits[256];

void main() {
    uint l = gl_LocalInvocationIndex, block = group(), count = sorted_count(), width = blocks(count, BLOCK);
    Words keys = push.keys;
    digits[l] = 0u;
    barrier();
    for (uint j = 0u; j < 8u; j++) {
        uint i = block * BLOCK + j * 256u + l;
        if (i < count) {
            uint key = keys.at[i];
            if (!is_dropped(key)) {
                atomicAdd(digits[key >> push.shift & 255u], 1u);
            }
        }
    }
    barrier();
    if (block < width) {
        push.histogram.at[l * width + block] = digits[l];
    }
}
