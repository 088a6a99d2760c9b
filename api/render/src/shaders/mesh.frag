#version 450
// The colour of a triangle, opaque.
layout(location = 0) in vec3 shaded;
layout(location = 0) out vec4 color;
void main() {
    color = vec4(shaded, 1.0);
}
