#version 450
// Hands on what Gaussians accumulated at a pixel, and which of them has the median depth and which is the nearest. The
// numbers count from 1, since the attachment is 0 where there is no fragment.
layout(location = 0) in vec4 accumulated;
layout(location = 1) flat in uvec2 median;
layout(location = 2) flat in uvec2 nearest;
layout(location = 0) out vec4 color;
layout(location = 1) out uvec2 gaussians;
void main() {
    color = accumulated;
    gaussians = uvec2(median.x, nearest.x) + 1u;
}
