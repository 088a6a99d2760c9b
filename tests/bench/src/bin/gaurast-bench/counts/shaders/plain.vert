#version 450
// Triangles as they lie in the buffer, with a colour at each corner.
layout(location = 0) in vec4 position;
layout(location = 1) in vec4 color;
layout(location = 0) out vec4 v_color;

void main() {
    gl_Position = position;
    v_color = color;
}
