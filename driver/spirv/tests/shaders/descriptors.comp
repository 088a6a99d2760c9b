// Adds the contents of four storage buffers, selected at run time, and two uniform buffers.
#version 450
layout(local_size_x = 16) in;
layout(set = 0, binding = 0) readonly buffer In { uint values[]; } sources[4];
layout(set = 1, binding = 0) uniform Numbers { uvec4 number; } numbers[2];
layout(set = 1, binding = 3) writeonly buffer Out { uint values[]; } target;
void main() {
    uint i = gl_GlobalInvocationID.x;
    uint which = (i / 4) % 4;
    target.values[i] = sources[which].values[i] + numbers[0].number.x + numbers[1].number.w;
}
