#version 450
layout(location = 0) in vec3 corner;
void main() {
    gl_Position = vec4(corner, 1.0);
}
