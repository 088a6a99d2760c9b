#version 450
// Tells the Gaussian that a pixel shows, and the point in space.

layout(location = 0) flat in uvec2 median; // Vertex and instance.
layout(location = 1) in vec2 linear_depth; // The expected and the median one.
layout(location = 2) flat in mat3x4 view; // From world to camera axes; a column is a row.
layout(location = 5) flat in vec4 lens; // Focal lengths and principal point.
layout(location = 7) flat in vec4 eye;

layout(push_constant) uniform Pointer { vec2 pixel; }; // From the corner of the viewport.

layout(location = 0) out uvec4 picked;

void main() {
    vec3 ray = vec3((pixel - lens.zw) / lens.xy, 1.0);
    // The transposed rotation takes camera axes to the world's.
    vec3 point = mat3(view) * (linear_depth.y * ray) + eye.xyz;
    picked = uvec4(median.x, floatBitsToUint(point));
}
