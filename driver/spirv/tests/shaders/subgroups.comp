// Built-ins and operations by which the invocations of a subgroup see each other.
#version 450
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_shuffle : require
layout(local_size_x = 128) in;
layout(set = 0, binding = 0) writeonly buffer Out { uvec4 values[]; } target;
void main() {
    uint i = gl_LocalInvocationIndex;
    uint neighbour = subgroupShuffleXor(i, 1);
    uint sum = subgroupAdd(i);
    uint odd = subgroupBallotBitCount(subgroupBallot(i % 2 == 1));
    target.values[i] = uvec4(
        gl_SubgroupSize | gl_NumSubgroups << 8 | gl_SubgroupID << 16 | gl_SubgroupInvocationID << 24,
        neighbour, sum, odd);
}
