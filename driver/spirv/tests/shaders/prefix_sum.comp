#version 450
layout(local_size_x = 128) in;
layout(set = 0, binding = 0) buffer Values { uint values[]; };
layout(set = 0, binding = 1) writeonly buffer Totals { uint totals[]; };
shared uint sums[256];

void main() {
    uint lane = gl_LocalInvocationIndex;
    uint first = gl_WorkGroupID.x * 256u;
    sums[2u * lane] = values[first + 2u * lane];
    sums[2u * lane + 1u] = values[first + 2u * lane + 1u];
    uint stride = 1u;
    for (uint running = 128u; running > 0u; running >>= 1u) {
        barrier();
        if (lane < running) {
            uint right = stride * (2u * lane + 2u) - 1u;
            sums[right] += sums[right - stride];
        }
        stride *= 2u;
    }
    barrier();
    if (lane == 0u) {
        totals[gl_WorkGroupID.x] = sums[255];
        sums[255] = 0u;
    }
    for (uint running = 1u; running < 256u; running *= 2u) {
        stride >>= 1u;
        barrier();
        if (lane < running) {
            uint left = stride * (2u * lane + 1u) - 1u;
            uint right = left + stride;
            uint kept = sums[left];
            sums[left] = sums[right];
            sums[right] += kept;
        }
    }
    barrier();
    values[first + 2u * lane] = sums[2u * lane];
    values[first + 2u * lane + 1u] = sums[2u * lane + 1u];
}
