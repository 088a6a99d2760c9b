// Each workgroup stores its index and the number of workgroups; each invocation stores its local index.
#version 450
layout(local_size_x = 3, local_size_y = 2, local_size_z = 2) in;
layout(set = 0, binding = 0) buffer Out { uint next; uint pad[3]; uvec4 values[]; } target;
void main() {
    uint slot = atomicAdd(target.next, 1);
    uvec3 id = gl_LocalInvocationID;
    uint local = id.x + 3 * (id.y + 2 * id.z);
    uvec3 global = gl_WorkGroupID * gl_WorkGroupSize + id;
    uint wrong = uint(local != gl_LocalInvocationIndex || global != gl_GlobalInvocationID);
    uvec3 count = gl_NumWorkGroups;
    target.values[slot] = uvec4(
        gl_WorkGroupID.x | gl_WorkGroupID.y << 8 | gl_WorkGroupID.z << 16,
        count.x | count.y << 8 | count.z << 16, local, wrong);
}
