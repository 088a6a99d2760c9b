#version 450
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
layout(local_size_x = 16) in;
layout(buffer_reference) buffer Node;
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Node { uint value; Node next; };
layout(push_constant) uniform Push { Node first; };
layout(set = 0, binding = 0) writeonly buffer Out { uint outputs[]; };
void main() {
    Node node = first;
    for (uint i = 0u; i < gl_LocalInvocationIndex; i++) node = node.next;
    outputs[gl_LocalInvocationIndex] = node.value;
}
