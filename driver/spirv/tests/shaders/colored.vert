#version 450
layout(location = 0) in vec4 position;
layout(location = 1) in vec4 color;
layout(push_constant) uniform Constants { vec4 offset; } constants;
layout(location = 0) out vec4 carried;
layout(location = 3) out vec4 unread;
void main() {
    gl_Position = position + constants.offset;
    gl_PointSize = 4.0;
    carried = color;
    unread = sqrt(color);
}
