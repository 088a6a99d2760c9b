#version 450
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0, rgba8) uniform readonly image2D source;
layout(set = 0, binding = 1, r32ui) uniform uimage2D counts;
layout(set = 0, binding = 2) uniform sampler2D textured;
layout(set = 0, binding = 3) uniform texture2DArray layers;
layout(set = 0, binding = 4) uniform sampler linear;
layout(set = 0, binding = 5, rgba32f) uniform writeonly imageCube cube;
layout(set = 0, binding = 6) uniform samplerBuffer texels;
layout(set = 0, binding = 8) uniform sampler2DShadow shadow;
void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    vec4 c = imageLoad(source, p);
    c += textureLod(textured, vec2(p) / vec2(textureSize(textured, 0)), 1.0);
    c += texture(sampler2DArray(layers, linear), vec3(0.5, 0.5, 2.0));
    c += texelFetch(texels, p.x);
    c += texelFetchOffset(textured, p, 0, ivec2(1, -1));
    c += textureGather(textured, vec2(0.5), 2);
    c += textureGrad(textured, vec2(0.5), vec2(0.1), vec2(0.2));
    c.x += texture(shadow, vec3(0.5, 0.5, 0.25));
    c.y += textureProjLod(textured, vec3(1.0, 2.0, 4.0), 0.0).y;
    const ivec2 offsets[4] = ivec2[](ivec2(0), ivec2(1, 0), ivec2(0, 1), ivec2(1, 1));
    c += textureGatherOffsets(textured, vec2(0.5), offsets);
    imageAtomicAdd(counts, p, 1u);
    imageStore(cube, ivec3(p, 7 % 6), c * float(textureQueryLevels(textured)) * float(imageSize(cube).x));
}
