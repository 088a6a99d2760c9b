#version 450
// The mesh: positions and colours, projected as the Gaussians' camera does it.

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 color;

layout(push_constant) uniform Frame {
    mat4 projection;
    vec4 fog; // Colour and density.
};

layout(location = 0) out vec3 surface;
layout(location = 1) out float distance_ahead;

void main() {
    gl_Position = projection * vec4(position, 1.0);
    surface = color;
    distance_ahead = gl_Position.w;
}
