#version 450
#extension GL_EXT_shader_explicit_arithmetic_types_float16 : require
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer Matrices { mat4 matrices[]; };
layout(set = 0, binding = 1) writeonly buffer Inverses { mat4 inverses[]; };
layout(set = 0, binding = 2) writeonly buffer Determinants { float determinants[]; };
void main() {
    uint i = gl_LocalInvocationIndex;
    f16mat4 m = f16mat4(matrices[i]);
    inverses[i] = mat4(inverse(m));
    determinants[i] = float(determinant(m));
}
