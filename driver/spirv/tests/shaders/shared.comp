// Inclusive prefix sums of 256 numbers each, in shared memory.
#version 450
layout(local_size_x = 256) in;
layout(set = 0, binding = 0) buffer Values { uint values[]; } data;
shared uint sums[256];
void main() {
    uint i = gl_LocalInvocationID.x;
    sums[i] = data.values[gl_GlobalInvocationID.x];
    for (uint step = 1; step < 256; step *= 2) {
        barrier();
        uint before = i >= step ? sums[i - step] : 0;
        barrier();
        sums[i] += before;
    }
    data.values[gl_GlobalInvocationID.x] = sums[i];
}
