#version 460
// Operations on pairs, whose bits the host knows.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "pair.glsl"
layout(local_size_x = 64) in;
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Pairs { vec2 at[]; };
layout(push_constant) uniform Push {
    Pairs operands;
    Pairs results;
} push;

void main() {
    uint i = gl_LocalInvocationID.x;
    vec2 a = push.operands.at[2u * i], b = push.operands.at[2u * i + 1u];
    push.results.at[6u * i] = two_sum(a.x, b.x);
    push.results.at[6u * i + 1u] = two_product(a.x, b.x);
    push.results.at[6u * i + 2u] = add(a, b);
    push.results.at[6u * i + 3u] = mul(a, b);
    push.results.at[6u * i + 4u] = div(a, b);
    push.results.at[6u * i + 5u] = root(a);
}
