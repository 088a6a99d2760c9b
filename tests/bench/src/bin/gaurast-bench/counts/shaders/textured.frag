#version 450
// A filtered texture, by the first two components of the interpolated colour.
layout(set = 0, binding = 0) uniform sampler2D image;
layout(location = 0) in vec4 v_color;
layout(location = 0) out vec4 color;

void main() {
    color = texture(image, v_color.xy);
}
