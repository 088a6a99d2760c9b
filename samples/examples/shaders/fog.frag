#version 450
// A resolve shader, which runs once for each pixel. It computes a colour from the accumulated values of the pixel: more
// fog with a greater expected depth, and then tone mapping.

layout(location = 0) in vec4 accumulated;
layout(location = 1) in vec2 depth;

layout(location = 0) out vec4 result;

const float NEAR = 1.0, FAR = 20.0;
const vec3 FOG = vec3(0.55, 0.62, 0.72);

void main() {
    float distance = NEAR * FAR / (FAR - depth.x * (FAR - NEAR));
    float fog = 1.0 - exp(-0.15 * max(distance - 3.0, 0.0));
    vec3 color = accumulated.rgb / max(accumulated.a, 1e-6);
    color = mix(1.0 - exp(-1.4 * color), FOG, fog);
    result = vec4(color * accumulated.a, accumulated.a);
}
