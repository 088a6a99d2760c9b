#version 450
layout(local_size_x = 64) in;
struct Body { vec4 position; vec4 velocity; };
layout(std430, set = 0, binding = 0) readonly buffer Before { Body before[]; };
layout(std430, set = 0, binding = 1) writeonly buffer After { Body after[]; };
layout(std140, set = 0, binding = 2) uniform Settings { float step; float softening; };
shared vec4 near[gl_WorkGroupSize.x];

vec3 pull(vec3 on, vec4 by) {
    vec3 apart = by.xyz - on;
    float square = dot(apart, apart) + softening * softening;
    return apart * (by.w * inversesqrt(square * square * square));
}

void main() {
    uint self = gl_GlobalInvocationID.x;
    uint count = uint(before.length());
    Body body = before[min(self, count - 1u)];
    vec3 acceleration = vec3(0.0);
    for (uint first = 0u; first < count; first += gl_WorkGroupSize.x) {
        near[gl_LocalInvocationIndex] = before[min(first + gl_LocalInvocationIndex, count - 1u)].position;
        barrier();
        for (uint k = 0u; k < gl_WorkGroupSize.x && first + k < count; k++) {
            acceleration += pull(body.position.xyz, near[k]);
        }
        barrier();
    }
    body.velocity.xyz += acceleration * step;
    body.position.xyz += body.velocity.xyz * step;
    if (self < count) {
        after[self] = body;
    }
}
