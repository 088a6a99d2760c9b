#version 460
// The difference of two samples that an earlier subpass left at this pixel, and their product.
layout(input_attachment_index = 0, binding = 0) uniform subpassInputMS first;
layout(location = 0) out vec4 color;
void main() {
    vec4 a = subpassLoad(first, 0), b = subpassLoad(first, 3);
    color = vec4(abs(a - b).rg, (a * b).ba);
}
