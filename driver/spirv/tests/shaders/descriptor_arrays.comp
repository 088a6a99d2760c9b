#version 450
layout(local_size_x = 4) in;
layout(set = 1, binding = 3) buffer Buffers { uint value; uint rest[]; } buffers[4];
layout(set = 0, binding = 2) writeonly buffer Out { uint outputs[]; };
void main() {
    uint i = gl_LocalInvocationIndex;
    outputs[i] = buffers[3u - i].value * 10u + uint(buffers[2].rest.length());
    buffers[i].rest[1] = i + 50u;
}
