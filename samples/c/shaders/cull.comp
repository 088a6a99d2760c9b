#version 450
// Writes an indirect draw for each cluster of Gaussians that may be in the picture, and counts them.

layout(local_size_x = 32) in;

struct Draw {
    uint vertices;
    uint instances;
    uint first_vertex;
    uint first_instance;
};

layout(std430, set = 0, binding = 0) buffer Draws {
    uint count;
    uint padding[3];
    Draw draws[];
};

layout(std430, set = 0, binding = 1) readonly buffer Clusters { vec4 clusters[]; }; // Middle and radius.

layout(push_constant) uniform Frame {
    mat4 projection;
    uint cluster_count;
    uint gaussians; // Of each cluster.
};

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= cluster_count) return;
    vec4 cluster = clusters[index];
    vec4 at = projection * vec4(cluster.xyz, 1.0);
    float reach = at.w + 2.5 * cluster.w;
    if (at.w < -cluster.w || abs(at.x) > reach || abs(at.y) > reach) return;
    draws[atomicAdd(count, 1u)] = Draw(gaussians, 1u, index * gaussians, 0u);
}
