// Every atomic operation on words that all invocations share.
#version 450
layout(local_size_x = 128) in;
layout(set = 0, binding = 0) buffer Values {
    uint added; uint maximum; uint minimum; uint ored; uint anded; uint xored; uint exchanged; uint swapped;
} data;
void main() {
    uint i = gl_GlobalInvocationID.x;
    atomicAdd(data.added, i);
    atomicMax(data.maximum, i);
    atomicMin(data.minimum, i + 7);
    atomicOr(data.ored, 1u << (i % 32));
    atomicAnd(data.anded, ~(1u << (i % 16)));
    atomicXor(data.xored, i);
    atomicExchange(data.exchanged, 1000 + i);
    // Counts up by one only from the number that was read.
    uint old, seen;
    do {
        old = data.swapped;
        seen = atomicCompSwap(data.swapped, old, old + 1);
    } while (seen != old);
}
