#version 450
#extension GL_EXT_multiview : require
// A projecting vertex shader whose outputs are its inputs, but for places and colours that differ from view to view.

layout(location = 0) in vec4 position;
layout(location = 1) in vec4 covariance_and_opacity;
layout(location = 2) in vec4 color_and_key;

layout(location = 0) out vec3 covariance;
layout(location = 1) out float opacity;
layout(location = 2) out vec3 color;
layout(location = 3) out float key;


void main() {
    gl_Position = position;
    gl_Position.x += 0.25 * float(gl_ViewIndex) * position.w;
    covariance = covariance_and_opacity.xyz;
    opacity = covariance_and_opacity.w;
    color = gl_ViewIndex == 2 ? 0.5 * color_and_key.rgb : color_and_key.rgb;
    key = color_and_key.w;
}
