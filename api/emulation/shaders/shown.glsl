// What a set has made of its area.

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Pixels { vec4 at[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer Words { uint at[]; };

layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer Floats { float at[]; };

layout(push_constant) uniform Push {
    Pixels image;                // of each view
    Words shown;                 // 1 for each tile, of each view, that has a contribution
    ivec2 area_origin;
    uvec2 area_size;
    Floats medians;              // the median depth of each sample
    uint samples;                // of a pixel that the set tells apart
    uint sample_;                // that is shown
    float wanted;                // what is shown: fragments, or one of the outcomes that have none
} push;

// Width and height of a tile.
const uint TILE = 16u;
