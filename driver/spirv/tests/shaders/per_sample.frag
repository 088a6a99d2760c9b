#version 450
layout(location = 0) out vec4 color;
void main() {
    color = vec4(float(1 << gl_SampleID), 0.0, 0.0, 1.0);
}
