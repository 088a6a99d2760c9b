#version 450
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_quad : require
#extension GL_KHR_shader_subgroup_vote : require
layout(location = 0) in vec4 value;
layout(location = 0) out vec4 color;
void main() {
    // The derivative is taken where the whole quad is active.
    bool uniform_here = subgroupQuadBroadcast(1u, 0u) == 1u;
    uvec4 ballot = subgroupBallot(uniform_here);
    float right = subgroupQuadSwapHorizontal(gl_FragCoord.x);
    switch (int(subgroupAny(true))) {
    case 1:
        color.x = dFdx(gl_FragCoord.x * 0.5);
        break;
    default:
        color.x = 9.0;
        break;
    }
    color.y = abs(right - gl_FragCoord.x);
    // The count of lanes, by a ballot and by a sum.
    uint counted = subgroupBallotBitCount(ballot);
    color.z = counted == subgroupAdd(1u) ? 1.0 : 0.0;
    color.w = counted <= gl_SubgroupSize && counted >= 4u ? value.x : 0.0;
}
