#version 460
// The difference and the product of two samples of an earlier subpass at this pixel.
layout(input_attachment_index = 0, binding = 0) uniform subpassInputMS first;
layout(location = 0) out vec4 color;
void main() {
    vec4 a = subpassLoad(first, 0), b = subpassLoad(first, 3);
    color = vec4(abs(a - b).rg, (a * b).ba);
}
