#version 450
layout(local_size_x = 16, local_size_y = 4) in;
layout(push_constant) uniform Push { uvec2 size; uint limit; } push;
layout(set = 0, binding = 0) writeonly buffer Counts { uint counts[]; };

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, push.size))) {
        return;
    }
    precise vec2 c = vec2(pixel) / vec2(push.size) * vec2(3.0, 2.0) - vec2(2.25, 1.0);
    precise vec2 z = vec2(0.0);
    uint steps = 0u;
    for (; steps < push.limit; steps++) {
        precise float x2 = z.x * z.x;
        precise float y2 = z.y * z.y;
        if (x2 + y2 > 4.0) {
            break;
        }
        z = vec2(x2 - y2, 2.0 * z.x * z.y) + c;
    }
    counts[pixel.y * push.size.x + pixel.x] = steps;
}
