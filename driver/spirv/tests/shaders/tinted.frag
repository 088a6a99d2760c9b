#version 450
layout(constant_id = 3) const float BRIGHTNESS = 1.0;
layout(location = 0) in vec4 carried;
layout(location = 7) in float missing;
layout(set = 0, binding = 0) uniform Tint { vec4 tint; } uniforms;
layout(set = 0, binding = 1) uniform sampler2D image;
layout(location = 0) out vec4 color;
void main() {
    color = texture(image, carried.xy) * uniforms.tint * BRIGHTNESS + missing;
}
