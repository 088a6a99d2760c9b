// out[i] = in[i] * scale + bias, with both numbers in push constants.
#version 450
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer In { uint values[]; } source;
layout(set = 0, binding = 1) writeonly buffer Out { uint values[]; } target;
layout(push_constant) uniform Push { uint scale; uint bias; } push;
void main() {
    uint i = gl_GlobalInvocationID.x;
    target.values[i] = source.values[i] * push.scale + push.bias;
}
