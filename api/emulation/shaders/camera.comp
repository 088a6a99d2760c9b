#version 460
// Copies cameras from a uniform buffer. Set and binding are those of the application, which the host writes over 0 and 1.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
layout(local_size_x = 64) in;
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Words { uint at[]; };
layout(constant_id = 0) const uint ROWS = 8u;
layout(set = 0, binding = 0) uniform Cameras { uvec4 rows[ROWS]; } cameras;
layout(push_constant) uniform Push {
    Words copy;
} push;

void main() {
    for (uint i = gl_LocalInvocationID.x; i < ROWS; i += 64u) {
        uvec4 row = cameras.rows[i];
        for (uint j = 0u; j < 4u; j++) {
            push.copy.at[4u * i + j] = row[j];
        }
    }
}
