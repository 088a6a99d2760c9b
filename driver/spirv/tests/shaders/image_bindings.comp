// Reads images by every kind of descriptor, and writes to a storage image and a texel buffer.
#version 450
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0) uniform sampler2D combined;
layout(set = 0, binding = 1) uniform texture2D pictures[2];
layout(set = 0, binding = 3) uniform sampler nearest;
layout(set = 0, binding = 4, rgba8) uniform image2D target;
layout(set = 0, binding = 5) uniform utextureBuffer numbers;
layout(set = 0, binding = 6, r32ui) uniform uimageBuffer counts;
void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    vec2 centre = (vec2(at) + 0.5) / 8.0;
    // Between four texels, the mean of them.
    vec4 mean = textureLod(combined, (floor(centre * 7.0) + 1.0) / 8.0, 0.0);
    vec4 texel = textureLod(sampler2D(pictures[at.x & 1], nearest), centre, 0.0);
    imageStore(target, at, vec4(mean.x, texel.y, float(texelFetch(numbers, at.x).x) / 255.0, 1.0));
    imageAtomicAdd(counts, at.y, uint(at.x));
}
