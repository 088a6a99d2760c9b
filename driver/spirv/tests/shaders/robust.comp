// Reads and writes far outside of the bound buffers.
#version 450
layout(local_size_x = 32) in;
layout(set = 0, binding = 0) buffer Small { uint values[]; } data;
layout(set = 0, binding = 1) uniform Numbers { uint number[64]; } numbers;
layout(set = 0, binding = 2) writeonly buffer Out { uint values[]; } target;
layout(push_constant) uniform Push { uint stride; } push;
void main() {
    uint i = gl_GlobalInvocationID.x;
    uint far = i * push.stride;
    target.values[3 * i] = data.values[far];
    target.values[3 * i + 1] = data.values.length();
    data.values[far] = 0xdeadbeef;
    target.values[3 * i + 2] = uint(atomicAdd(data.values[far + 8], 1));
}
