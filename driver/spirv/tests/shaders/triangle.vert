#version 450
layout(location = 0) in vec2 position;
layout(location = 1) in vec3 color;
layout(location = 2) in vec4 unused;
layout(location = 0) out vec3 out_color;
layout(push_constant) uniform Push { layout(offset = 16) mat4 transform; };
void main() {
    gl_Position = transform * vec4(position, float(gl_InstanceIndex), 1.0);
    out_color = color;
}
