#version 450
#extension GL_EXT_shared_memory_block : require
#extension GL_EXT_shader_explicit_arithmetic_types_int16 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int8 : require
// Blocks of shared memory alias each other.
layout(local_size_x = 64) in;
shared Words { uint words[64]; };
shared Halves { layout(offset = 4) uint16_t halves[126]; };
shared Bytes { uint8_t bytes[256]; };
layout(set = 0, binding = 0) writeonly buffer Results { uint results[]; };
void main() {
    uint i = gl_LocalInvocationIndex;
    words[i] = 0x10203u * (i + 1u);
    barrier();
    // The upper half of the next word but one.
    results[i] = uint(halves[min(2u * i + 1u, 125u)]);
    results[64 + i] = uint(bytes[4u * i + 1u]);
    barrier();
    bytes[4u * i + 3u] = uint8_t(i);
    barrier();
    results[128 + i] = words[i];
}
