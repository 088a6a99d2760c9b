#version 460
// Moves keys and values to the places of their digits; equal digits keep their order.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "set.glsl"
#include "sort.glsl"
layout(local_size_x = 256) in;
// A bit for each invocation, by digit.
shared uint holders[2048];
shared uint places[256];

void main() {
    uint l = gl_LocalInvocationID.x, block = group(), count = sorted_count(), width = blocks(count, BLOCK);
    Words keys = sorted_keys(), values = sorted_values();
    uint from = sorted_half(push.side), to = sorted_half(1u - push.side);
    uint place = l * width + block;
    places[l] = block < width ? push.set.histogram.at[place] + push.set.sums.at[place / BLOCK] : 0u;
    for (uint j = 0u; j < 8u; j++) {
        for (uint k = 0u; k < 8u; k++) {
            holders[k * 256u + l] = 0u;
        }
        barrier();
        uint i = block * BLOCK + j * 256u + l, key = 0u, value = 0u, digit = 0u;
        bool is_moved = i < count;
        if (is_moved) {
            key = keys.at[from + i];
            value = values.at[from + i];
            digit = key >> push.shift & 255u;
            is_moved = !is_dropped(key);
        }
        if (is_moved) {
            atomicOr(holders[digit * 8u + (l >> 5)], 1u << (l & 31u));
        }
        barrier();
        if (is_moved) {
            uint rank = places[digit];
            for (uint k = 0u; k < l >> 5; k++) {
                rank += bitCount(holders[digit * 8u + k]);
            }
            rank += bitCount(holders[digit * 8u + (l >> 5)] & ((1u << (l & 31u)) - 1u));
            keys.at[to + rank] = key;
            values.at[to + rank] = value;
        }
        barrier();
        uint taken = 0u;
        for (uint k = 0u; k < 8u; k++) {
            taken += bitCount(holders[l * 8u + k]);
        }
        places[l] += taken;
        barrier();
    }
}
