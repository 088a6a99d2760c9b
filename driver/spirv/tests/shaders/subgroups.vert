#version 450
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_arithmetic : require
layout(location = 0) in vec4 position;
layout(location = 0) out vec4 value;
void main() {
    gl_Position = position;
    uint counted = subgroupBallotBitCount(subgroupBallot(true));
    value = vec4(counted == subgroupAdd(1u) && counted >= 3u ? float(gl_SubgroupSize) : 0.0);
}
