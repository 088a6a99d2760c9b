#version 450
layout(location = 0) flat out double wide;
void main() {
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
    wide = double(gl_VertexIndex);
}
