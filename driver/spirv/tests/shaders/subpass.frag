#version 460
// The results of an earlier subpass at this pixel: colour with green and blue exchanged, and depth for alpha.
layout(input_attachment_index = 0, binding = 0) uniform subpassInput first;
layout(input_attachment_index = 1, binding = 1) uniform subpassInput depth;
layout(location = 0) out vec4 color;
void main() {
    color = vec4(subpassLoad(first).rbg, subpassLoad(depth).r);
}
