#version 460
// Copies the depths, or with STENCILS the stencils, of an attachment with several samples.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "head.glsl"
layout(local_size_x = 16, local_size_y = 16) in;

layout(buffer_reference, std430, buffer_reference_align = 4) writeonly buffer Words { uint at[]; };

#ifdef STENCILS
layout(set = 0, binding = 0) uniform utexture2DMSArray attachment;
#else
layout(set = 0, binding = 0) uniform texture2DMSArray attachment;
#endif

layout(push_constant) uniform Push {
    Words copied;                // of each sample of each layer
    ivec2 area_origin;
    uvec2 area_size;
    uint samples;                // of a pixel
} push;

void main() {
    uvec2 at = gl_GlobalInvocationID.xy, size = push.area_size;
    uint layer = gl_WorkGroupID.z;
    if (any(greaterThanEqual(at, size))) {
        return;
    }
    for (uint j = 0u; j < push.samples; j++) {
        ivec3 place = ivec3(ivec2(at) + push.area_origin, layer);
        uint plane = layer * push.samples + j;
#ifdef STENCILS
        uint value = texelFetch(attachment, place, int(j)).x;
#else
        uint value = floatBitsToUint(texelFetch(attachment, place, int(j)).x);
#endif
        push.copied.at[(plane * size.y + at.y) * size.x + at.x] = value;
    }
}
