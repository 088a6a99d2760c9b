#version 450
// Makes Gaussians: rings of flat discs that wobble with time, one ring for each instance.

layout(push_constant) uniform Frame {
    float time;
};

// The locations that the pipeline names.
layout(location = 0) out vec3 covariance;
layout(location = 1) out float opacity;
layout(location = 2) out vec3 color;

const float TAU = 6.2831853;
const float FOCAL = 240.0, SIDE = 256.0, NEAR = 1.0, FAR = 20.0;

void main() {
    float ring = float(gl_InstanceIndex);
    float u = TAU * float(gl_VertexIndex % 96) / 96.0, v = TAU * float(gl_VertexIndex / 96) / 24.0;

    // A torus with a tube of varying thickness, rotated about its own axis.
    float tube = 0.3 + 0.12 * sin(3.0 * u + time + 2.0 * ring);
    vec3 outward = vec3(cos(u) * cos(v), sin(u) * cos(v), sin(v));
    vec3 p = vec3(cos(u), sin(u), 0.0) + tube * outward;
    float turn = 0.9 + 0.3 * time + 1.3 * ring;
    mat3 turned = mat3(cos(turn), 0.0, -sin(turn), 0.0, 1.0, 0.0, sin(turn), 0.0, cos(turn));
    vec3 normal = turned * outward;
    vec3 t = turned * p + vec3(1.5 * sin(2.4 * ring + 3.6), 1.2 * cos(1.7 * ring + 1.1), 4.4 + 2.0 * ring);

    // A disc of deviation 0.045 along the surface and 0.008 across it, then the pinhole's Jacobian.
    mat3 disc = 0.045 * 0.045 * mat3(1.0)
        + (0.008 * 0.008 - 0.045 * 0.045) * outerProduct(normal, normal);
    vec3 across = FOCAL * vec3(1.0 / t.z, 0.0, -t.x / (t.z * t.z));
    vec3 down = FOCAL * vec3(0.0, 1.0 / t.z, -t.y / (t.z * t.z));
    covariance = vec3(dot(across, disc * across), dot(across, disc * down), dot(down, disc * down));

    vec3 hue = 0.5 + 0.5 * cos(TAU * (0.13 * ring + vec3(0.0, 0.33, 0.67)) + u);
    float light = max(dot(normal, normalize(vec3(-0.4, -0.7, -0.6))), 0.0);
    color = hue * (0.25 + 2.5 * light);
    opacity = 0.85;

    // Gaussians are sorted by w, nearest first, since no location names a depth key.
    float depth = FAR / (FAR - NEAR) * (t.z - NEAR);
    gl_Position = vec4(2.0 * FOCAL / SIDE * t.xy, depth, t.z);
}
