#version 460
// Stores values to an image and a texel buffer, and fetches from a texel buffer. Compiled for floats, unsigned and signed
// integers, with V, IMAGE, IMAGE_BUFFER and SAMPLER_BUFFER defined as the types' names.
layout(local_size_x = 64) in;
layout(binding = 0) uniform writeonly IMAGE stored;
layout(binding = 1) uniform writeonly IMAGE_BUFFER stored_texels;
layout(binding = 2) uniform SAMPLER_BUFFER texels;
layout(binding = 3, std430) readonly buffer Values { V values[]; };
layout(binding = 4, std430) writeonly buffer Results { V results[]; };

void main() {
    int i = int(gl_GlobalInvocationID.x);
    imageStore(stored, ivec2(i % 16, i / 16), values[i]);
    imageStore(stored_texels, i, values[i]);
    results[i] = texelFetch(texels, i);
}
