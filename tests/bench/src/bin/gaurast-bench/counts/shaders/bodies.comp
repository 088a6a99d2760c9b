#version 450
// Computes the attraction of each body by all others, tile by tile in workgroup memory.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer Bodies { vec4 bodies[]; };
layout(set = 0, binding = 1) writeonly buffer Pulls { vec4 pulls[]; };
shared vec4 tile[64];

void main() {
    uint lane = gl_LocalInvocationIndex;
    vec3 own = bodies[gl_GlobalInvocationID.x].xyz;
    vec3 pull = vec3(0.0);
    for (uint first = 0u; first < bodies.length(); first += 64u) {
        tile[lane] = bodies[first + lane];
        barrier();
        for (uint k = 0u; k < 64u; k++) {
            vec3 apart = tile[k].xyz - own;
            float square = dot(apart, apart) + 0.01;
            pull += apart * (tile[k].w / (square * sqrt(square)));
        }
        barrier();
    }
    pulls[gl_GlobalInvocationID.x] = vec4(pull, 1.0);
}
