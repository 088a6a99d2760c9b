#version 450
// A projecting vertex shader whose outputs are its inputs, but for factors that tests set.

layout(location = 0) in vec4 position;
layout(location = 1) in vec4 covariance_and_opacity;
layout(location = 2) in vec4 color_and_key;

layout(location = 0) out vec3 covariance;
layout(location = 1) out float opacity;
layout(location = 2) out vec3 color;
layout(location = 3) out float key;

layout(set = 0, binding = 0) uniform Tint { vec4 tint; };
layout(push_constant) uniform Fade { float fade; };

void main() {
    gl_Position = position;
    covariance = covariance_and_opacity.xyz;
    opacity = covariance_and_opacity.w * fade;
    color = color_and_key.rgb * tint.rgb;
    key = color_and_key.w;
}
