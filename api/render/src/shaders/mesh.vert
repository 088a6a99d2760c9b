#version 450
// The vertices of triangles, with their colours.
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 color;
layout(location = 0) out vec3 shaded;
layout(push_constant) uniform Constants {
    mat4 to_clip;
};
void main() {
    gl_Position = to_clip * vec4(position, 1.0);
    shaded = color;
}
