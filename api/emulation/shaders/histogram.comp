#version 460
// The number of keys with each digit, by blocks of keys.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "set.glsl"
#include "sort.glsl"
layout(local_size_x = 256) in;
shared uint digits[256];

void main() {
    uint l = gl_LocalInvocationID.x, block = group(), count = sorted_count();
    digits[l] = 0u;
    barrier();
    for (uint j = 0u; j < 8u; j++) {
        uint i = block * BLOCK + j * 256u + l;
        if (i < count) {
            uint key = sorted_keys().at[sorted_half(push.side) + i];
            if (!is_dropped(key)) {
                atomicAdd(digits[key >> push.shift & 255u], 1u);
            }
        }
    }
    barrier();
    uint width = blocks(count, BLOCK);
    if (block < width) {
        push.set.histogram.at[l * width + block] = digits[l];
    }
}
