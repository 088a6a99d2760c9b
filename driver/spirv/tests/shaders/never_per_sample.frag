#version 450
layout(constant_id = 0) const bool reads = false;
layout(location = 0) out vec4 color;
void main() {
    color = vec4(1.0);
    if (reads) color.x = gl_SamplePosition.x;
}
