#version 460
// The fragment that a set has made of its pixel, if it has.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
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
    vec4 value = push.image.at[(view * push.area_size.y + at.y) * push.area_size.x + at.x];
    if (value.w < 0.0) {
        discard;
    }
    color = value;
}
