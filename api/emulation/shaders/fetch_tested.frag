#version 460
// The fragment that a set has made of a sample, with its median depth; or one without colour where the set has come to another outcome.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "outcomes.glsl"
#include "shown.glsl"
#ifdef VIEWS
layout(location = 0) flat in uint view;
#else
const uint view = 0u;
#endif
layout(location = 0) out vec4 color;

void main() {
    uvec2 at = uvec2(ivec2(gl_FragCoord.xy) - push.area_origin);
    if (any(greaterThanEqual(at, push.area_size))) {
        discard;
    }
    uint plane = view * push.samples + push.sample_, pixel = (plane * push.area_size.y + at.y) * push.area_size.x + at.x;
    vec4 value = push.image.at[pixel];
    if (value.w < 0.0 ? value.w != push.wanted : push.wanted < 0.0) {
        discard;
    }
    // Alpha to coverage takes nothing away of what has no colour.
    color = value.w < 0.0 ? vec4(0.0, 0.0, 0.0, 1.0) : value;
    gl_FragDepth = push.medians.at[pixel];
    gl_SampleMask[0] = push.samples == 1u ? -1 : 1 << push.sample_;
}
