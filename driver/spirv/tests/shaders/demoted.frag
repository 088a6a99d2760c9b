#version 450
#extension GL_EXT_demote_to_helper_invocation : require
layout(location = 0) in vec4 carried;
layout(location = 0) out vec4 color;
void main() {
    if (int(gl_FragCoord.x) % 2 == 1) demote;
    // The demoted neighbour still computes, for derivatives.
    color = vec4(dFdx(gl_FragCoord.x), carried.yzw);
}
