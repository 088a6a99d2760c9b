#version 450
#extension GL_EXT_nonuniform_qualifier : require
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer Source { uint value; } sources[];
layout(set = 0, binding = 1) writeonly buffer Results { uint results[]; };
void main() {
    uint i = gl_LocalInvocationIndex;
    results[i] = sources[nonuniformEXT(i % 4u)].value;
}
