// What is scanned: the histogram of a sort, or, with sort = 2, the numbers of tiles that Gaussians reach.
#include "sort.glsl"

uint scanned_count() {
    if (push.sort == 2u) {
        return push.set.counters.at[SEEN];
    }
    return 256u * blocks(sorted_count(), BLOCK);
}

Words scanned() {
    if (push.sort == 2u) {
        return push.set.counts;
    }
    return push.set.histogram;
}

shared uint partial[256];

// The sum of what the invocations before this one give; partial[255] is the sum of all.
uint sum_before(uint own) {
    uint l = gl_LocalInvocationID.x;
    partial[l] = own;
    barrier();
    for (uint d = 1u; d < 256u; d <<= 1) {
        uint other = l >= d ? partial[l - d] : 0u;
        barrier();
        partial[l] += other;
        barrier();
    }
    return partial[l] - own;
}
