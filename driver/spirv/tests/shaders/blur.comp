#version 450
layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = 0) const int RADIUS = 2;
layout(set = 0, binding = 0) readonly buffer Source { vec4 source[]; };
layout(set = 0, binding = 1) writeonly buffer Target { vec4 target[]; };
layout(push_constant) uniform Push { ivec2 size; } push;
const float weights[5] = float[](0.4, 0.25, 0.15, 0.1, 0.05);

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (at.x >= push.size.x || at.y >= push.size.y) return;
    vec4 sum = vec4(0.0);
    float total = 0.0;
    for (int dy = -RADIUS; dy <= RADIUS; dy++) {
        for (int dx = -RADIUS; dx <= RADIUS; dx++) {
            ivec2 p = clamp(at + ivec2(dx, dy), ivec2(0), push.size - 1);
            float w = weights[abs(dx)] * weights[abs(dy)];
            sum += w * source[p.y * push.size.x + p.x];
            total += w;
        }
    }
    target[at.y * push.size.x + at.x] = sum / total;
}
