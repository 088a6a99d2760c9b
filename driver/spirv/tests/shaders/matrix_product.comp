#version 450
// c = a b for square matrices, by tiles in workgroup memory. The tile's edge is a specialization constant.
layout(constant_id = 1) const uint TILE = 8u;
layout(local_size_x = 8, local_size_y = 8, local_size_x_id = 1, local_size_y_id = 1) in;
layout(set = 0, binding = 0) readonly buffer A { float a[]; };
layout(set = 0, binding = 1) readonly buffer B { float b[]; };
layout(set = 0, binding = 2) writeonly buffer C { float c[]; };
layout(push_constant) uniform Push { uint n; };

shared float tile_a[TILE][TILE];
shared float tile_b[TILE][TILE];

void main() {
    uvec2 local = gl_LocalInvocationID.xy;
    uvec2 at = gl_WorkGroupID.xy * TILE + local;
    float sum = 0.0;
    for (uint tile = 0u; tile < n; tile += TILE) {
        tile_a[local.y][local.x] = a[at.y * n + tile + local.x];
        tile_b[local.y][local.x] = b[(tile + local.y) * n + at.x];
        barrier();
        for (uint k = 0u; k < TILE; k++) {
            sum += tile_a[local.y][k] * tile_b[k][local.x];
        }
        barrier();
    }
    c[at.y * n + at.x] = sum;
}
