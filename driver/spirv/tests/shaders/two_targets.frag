#version 450
layout(location = 0) in vec4 carried;
layout(location = 0) out vec4 color;
layout(location = 1) out vec4 inverse;
void main() {
    color = carried;
    inverse = vec4(1.0) - carried;
}
