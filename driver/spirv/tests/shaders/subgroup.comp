#version 450
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#extension GL_KHR_shader_subgroup_shuffle_relative : require
#extension GL_KHR_shader_subgroup_clustered : require
#extension GL_KHR_shader_subgroup_quad : require
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) writeonly buffer Out { uint outputs[]; };
void main() {
    uint i = gl_LocalInvocationIndex;
    uint at = 24u * i;
    uvec4 odd = subgroupBallot((i & 1u) != 0u);
    outputs[at] = gl_SubgroupInvocationID;
    outputs[at + 1u] = gl_SubgroupID;
    outputs[at + 2u] = subgroupAdd(i);
    outputs[at + 3u] = subgroupInclusiveAdd(i);
    outputs[at + 4u] = subgroupExclusiveAdd(i);
    outputs[at + 5u] = subgroupMax(i ^ 5u);
    outputs[at + 6u] = uint(subgroupAll(i < 64u)) | uint(subgroupAny(i == 3u)) << 1;
    outputs[at + 7u] = odd.x;
    outputs[at + 8u] = subgroupBallotBitCount(odd);
    outputs[at + 9u] = subgroupBallotFindLSB(odd);
    outputs[at + 10u] = subgroupBallotFindMSB(odd);
    outputs[at + 11u] = subgroupShuffle(i * 2u, 3u);
    outputs[at + 12u] = subgroupShuffleXor(i, 1u);
    outputs[at + 13u] = subgroupClusteredAdd(i, 4u);
    outputs[at + 14u] = subgroupQuadSwapHorizontal(i);
    outputs[at + 15u] = subgroupQuadBroadcast(i, 2u);
    outputs[at + 16u] = gl_SubgroupLtMask.x;
    outputs[at + 17u] = gl_SubgroupGeMask.x;
    outputs[at + 18u] = subgroupBallotExclusiveBitCount(odd);
    outputs[at + 19u] = uint(subgroupInverseBallot(odd));
    outputs[at + 20u] = subgroupShuffleUp(i, 1u);
    outputs[at + 21u] = subgroupBroadcastFirst(i + 7u);
    outputs[at + 22u] = uint(subgroupElect());
    outputs[at + 23u] = gl_NumSubgroups * 1000u + gl_SubgroupSize;
}
