#version 450
// The mesh in fog. It is opaque, and no Gaussian.

layout(location = 0) in vec3 surface;
layout(location = 1) in float distance_ahead;

layout(push_constant) uniform Frame {
    mat4 projection;
    vec4 fog; // Colour and density.
};

layout(location = 0) out vec4 result;
layout(location = 1) out uint picked;

void main() {
    float clear = exp(-fog.a * distance_ahead);
    result = vec4(mix(fog.rgb, surface, clear), 1.0);
    picked = 0u;
}
