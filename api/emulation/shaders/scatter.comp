#version 460
// Moves keys and values to the places of their digits; equal digits keep their order.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "counters.glsl"
#include "sort.glsl"
const uint INVOCATIONS = 256u;
layout(local_size_x = INVOCATIONS) in;
#include "scan.glsl"
// A bit for each invocation, by digit.
shared uint holders[2048];
shared uint places[256];

void main() {
    uint l = gl_LocalInvocationIndex, block = group(), count = sorted_count(), width = blocks(count, BLOCK), all;
    Words keys = push.keys, values = push.values, sorted_keys = push.sorted_keys, sorted_values = push.sorted_values;
    uint own = block < width ? push.histogram.at[l * width + block] : 0u;
    places[l] = own + sum_before(push.totals.at[l], all);
    if (push.is_first_of_depths != 0u && block == 0u && l == 0u) {
        push.counters.at[SEEN] = all;
        set_groups(push.counters, BY_SEEN, blocks(all, 256u));
        set_groups(push.counters, SORT_SEEN, blocks(all, BLOCK));
    }
    for (uint k = 0u; k < 8u; k++) {
        holders[k * 256u + l] = 0u;
    }
    barrier();
    for (uint j = 0u; j < 8u; j++) {
        uint i = block * BLOCK + j * 256u + l, key = 0u, value = i;
        bool is_moved = i < count;
        if (is_moved) {
            key = keys.at[i];
            is_moved = !is_dropped(key);
            if (push.is_first_of_depths == 0u) {
                value = values.at[i];
            }
        }
        uint digit = key >> push.shift & 255u;
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
            sorted_keys.at[rank] = key;
            sorted_values.at[rank] = value;
        }
        barrier();
        uint taken = 0u;
        for (uint k = 0u; k < 8u; k++) {
            taken += bitCount(holders[l * 8u + k]);
            holders[l * 8u + k] = 0u;
        }
        places[l] += taken;
        barrier();
    }
}
