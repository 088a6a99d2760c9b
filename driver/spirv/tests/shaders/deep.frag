#version 450
// A resolve shader that writes a depth, which it must not.

layout(location = 0) in vec4 accumulated;
layout(location = 0) out vec4 color;

void main() {
    color = accumulated;
    gl_FragDepth = 0.5;
}
