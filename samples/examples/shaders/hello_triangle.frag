#version 450
layout(location = 0) in vec3 carried;
layout(location = 0) out vec4 color;
void main() {
    color = vec4(carried, 1.0);
}
