#version 450
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) buffer Cells { uint cells[16]; int lowest; int highest; uint exchanged; uint locks; };
shared uint local_max;
void main() {
    uint i = gl_GlobalInvocationID.x;
    atomicAdd(cells[i % 16u], i);
    atomicMin(lowest, int(i) - 20);
    atomicMax(highest, int(i) - 20);
    atomicXor(exchanged, 1u << (i & 31u));
    if (gl_LocalInvocationIndex == 0u) local_max = 5u;
    barrier();
    atomicMax(local_max, i);
    barrier();
    if (gl_LocalInvocationIndex == 0u) atomicCompSwap(locks, 0u, local_max);
}
