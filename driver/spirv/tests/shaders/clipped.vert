#version 450
layout(location = 0) in vec4 position;
layout(location = 1) in vec4 color;
layout(location = 0) out vec4 carried;
out float gl_ClipDistance[2];
out float gl_CullDistance[1];
void main() {
    gl_Position = position;
    gl_ClipDistance[0] = 1.0;
    gl_ClipDistance[1] = position.x;
    gl_CullDistance[0] = color.a - 0.5;
    carried = color;
}
