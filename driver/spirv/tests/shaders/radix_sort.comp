#version 450
// Sorts the keys of each workgroup's 256, four bits at a time, stably.
layout(local_size_x = 256) in;
layout(set = 0, binding = 0) buffer Keys { uint keys[]; };
shared uint current[256];
shared uint counts[16];
shared uint starts[16];
shared uint digits[256];

void main() {
    uint lane = gl_LocalInvocationIndex;
    current[lane] = keys[gl_GlobalInvocationID.x];
    for (uint shift = 0u; shift < 32u; shift += 4u) {
        barrier();
        uint key = current[lane];
        uint digit = bitfieldExtract(key, int(shift), 4);
        digits[lane] = digit;
        if (lane < 16u) counts[lane] = 0u;
        barrier();
        atomicAdd(counts[digit], 1u);
        barrier();
        if (lane < 16u) {
            uint start = 0u;
            for (uint d = 0u; d < lane; d++) start += counts[d];
            starts[lane] = start;
        }
        barrier();
        uint rank = starts[digit];
        for (uint other = 0u; other < lane; other++) {
            if (digits[other] == digit) rank++;
        }
        barrier();
        current[rank] = key;
    }
    barrier();
    keys[gl_GlobalInvocationID.x] = current[lane];
}
