#version 450
// The device's fixed-function projection as a vertex shader, for a pinhole at the origin that looks along +z. Each
// invocation projects one Gaussian.

layout(push_constant) uniform Camera {
    vec2 size; // The picture's size in pixels.
    vec2 focal;
};

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 scale;
layout(location = 2) in vec4 rotation; // w, x, y, z.
layout(location = 3) in float opacity;
layout(location = 4) in vec3 harmonic;

// The locations that the pipeline names.
layout(location = 0) out vec3 covariance;
layout(location = 1) out float opacity_out;
layout(location = 2) out vec3 color;

const float NEAR = 0.2, FAR = 100.0;

void main() {
    vec4 q = rotation / length(rotation);
    float w = q.x, x = q.y, y = q.z, z = q.w;
    mat3 turned = mat3(
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
        2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
        2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
    mat3 axes = mat3(scale.x * turned[0], scale.y * turned[1], scale.z * turned[2]);

    // The rows of the Jacobian. Slopes are clamped a little beyond the picture's edges.
    vec3 t = position;
    vec2 slope = clamp(t.xy / t.z, -0.65 * size / focal, 0.65 * size / focal);
    vec3 across = focal.x / t.z * vec3(1.0, 0.0, -slope.x) * axes;
    vec3 down = focal.y / t.z * vec3(0.0, 1.0, -slope.y) * axes;
    covariance = vec3(dot(across, across), dot(across, down), dot(down, down));

    opacity_out = opacity;
    color = max(0.5 + 0.28209479 * harmonic, 0.0);
    gl_Position = vec4(2.0 * focal / size * t.xy, FAR / (FAR - NEAR) * (t.z - NEAR), t.z);
}
