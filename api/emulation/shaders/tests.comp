#version 460
// The tests of a sample that Gaussians take no part in: depth bounds and stencil. Depths and stencils were copied from the attachment.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
layout(local_size_x = 256) in;

layout(buffer_reference, std430, buffer_reference_align = 8) writeonly buffer Couples { uvec2 at[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer Words { uint at[]; };

layout(push_constant) uniform Push {
    Couples stored;
    Words depths;                // as in the attachment
    Words stencils;
    uint count;                  // of samples
    uint depth_bytes;            // 2 or 4; 0 without depths
    uint depth_steps;            // 2^n - 1 of n bits; 0 of floats
    uint stencil_bytes;          // 1 or 4; 0 without stencils
    float least, most;           // the bounds; the least is above the most without a test of them
    uint stencil_compare;        // operation | compare mask << 8 | reference << 16
    uint are_floats;             // depths with steps were read as numbers from 0 to 1
} push;

const uint OUT_OF_BOUNDS = 0u, STENCIL_FAILED = 1u, GOES_ON = 2u;

void main() {
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 256u + gl_LocalInvocationIndex;
    if (i >= push.count) {
        return;
    }
    float depth = 0.0, value = 0.0;
    if (push.depth_bytes != 0u) {
        uint word = push.depths.at[i * push.depth_bytes / 4u];
        uint bits = push.depth_bytes == 2u ? word >> 16u * (i & 1u) & 0xffffu : word;
        float steps = float(push.depth_steps);
        if (push.depth_steps == 0u) {
            depth = uintBitsToFloat(bits);
            value = depth;
        } else {
            depth = push.are_floats != 0u ? roundEven(uintBitsToFloat(bits) * steps) : float(bits & push.depth_steps);
            value = depth / steps;
        }
    }
    uint outcome = GOES_ON;
    if (push.stencil_bytes != 0u) {
        uint word = push.stencils.at[i * push.stencil_bytes / 4u];
        uint stencil = push.stencil_bytes == 1u ? word >> 8u * (i & 3u) & 0xffu : word;
        uint mask = push.stencil_compare >> 8 & 0xffu, own = push.stencil_compare >> 16 & mask, other = stencil & mask;
        // The reference is compared with what is stored.
        uint is = own < other ? 1u : own == other ? 2u : 4u;
        outcome = (push.stencil_compare & is) != 0u ? GOES_ON : STENCIL_FAILED;
    }
    if (push.least <= push.most && !(value >= push.least && value <= push.most)) {
        outcome = OUT_OF_BOUNDS;
    }
    push.stored.at[i] = uvec2(floatBitsToUint(depth), outcome);
}
