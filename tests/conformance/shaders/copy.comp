#version 450
// Copies words of a buffer to another one.

layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer From { uint from[]; };
layout(set = 0, binding = 1) writeonly buffer To { uint to[]; };

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at < from.length()) {
        to[at] = from[at];
    }
}
