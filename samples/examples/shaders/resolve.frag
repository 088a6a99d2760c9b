#version 450
// Resolve shaders, which run once for each pixel and compute a colour from its accumulated values.

layout(constant_id = 0) const int KIND = 0;

layout(location = 0) in vec4 accumulated; // Premultiplied.
layout(location = 1) in vec2 depth; // The expected and the median one.

layout(location = 0) out vec4 result;

const float NEAR = 0.2, FAR = 100.0;

// A colour from red to blue for a depth from 2.8 to 5.2.
vec4 rainbow(float depth) {
    float distance = NEAR * FAR / (FAR - depth * (FAR - NEAR));
    float at = clamp((distance - 2.8) / 2.4, 0.0, 1.0);
    return vec4(0.5 + 0.5 * cos(4.5 * at - vec3(0.0, 2.1, 4.2)), 1.0);
}

void main() {
    if (KIND == 0) {
        // Four tones, and a dark edge where it is almost transparent.
        vec3 color = accumulated.rgb / max(accumulated.a, 1e-6);
        color = ceil(4.0 * color - 0.5) / 4.0;
        float alpha = step(0.15, accumulated.a);
        result = vec4(color * step(0.3, accumulated.a), 1.0) * alpha;
    } else {
        result = rainbow(KIND == 1 ? depth.x : depth.y) * step(0.15, accumulated.a);
    }
}
