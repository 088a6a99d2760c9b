#version 460
// The vertices of a mesh, coloured by their normals.

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 0) out vec3 color;

layout(push_constant) uniform Constants {
    mat4 to_clip;
};

void main() {
    gl_Position = to_clip * vec4(position, 1.0);
    color = 0.5 + 0.5 * normal;
}
