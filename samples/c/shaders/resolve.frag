#version 450
// The resolve shader of a sorted set: fog by the expected depth, and the Gaussian that a pixel shows.

layout(location = 0) in vec4 accumulated;  // Premultiplied.
layout(location = 1) in vec2 linear_depth; // The expected and the median one.
layout(location = 2) flat in uvec2 median; // Vertex and instance.

layout(push_constant) uniform Frame {
    layout(offset = 64) vec4 fog; // Colour and density.
};

layout(location = 0) out vec4 result;
layout(location = 1) out uint picked;

void main() {
    float clear = exp(-fog.a * linear_depth.x);
    // Fog is before the Gaussians, and covers as much as they do: premultiplied, too.
    result = vec4(mix(fog.rgb * accumulated.a, accumulated.rgb, clear), accumulated.a);
    picked = median.x + 1u; // 0 is no Gaussian.
}
