#version 450
layout(location = 0) in vec3 normal;
layout(location = 1) in vec3 corner;
layout(location = 0) out vec4 color;
void main() {
    vec3 pixels = corner / fwidth(corner);
    float line = clamp(min(pixels.x, min(pixels.y, pixels.z)), 0.0, 1.0);
    float light = max(dot(normalize(normal), normalize(vec3(-0.5, -0.7, 0.8))), 0.0);
    color = vec4(mix(vec3(0.05, 0.1, 0.2), vec3(0.95, 0.65, 0.3) * (0.2 + 0.8 * light), line), 1.0);
}
