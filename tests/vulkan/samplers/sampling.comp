#version 460
// Samples an image of one kind in one way, request by request.
layout(local_size_x = 64) in;
layout(binding = 0) uniform sampler1D one;
layout(binding = 1) uniform sampler2D two;
layout(binding = 2) uniform sampler3D three;
layout(binding = 3) uniform samplerCube cube;
layout(binding = 4) uniform sampler1DArray ones;
layout(binding = 5) uniform sampler2DArray twos;
layout(binding = 6) uniform samplerCubeArray cubes;
layout(binding = 7) uniform sampler2DShadow shadow;
layout(binding = 8) uniform sampler2DArrayShadow shadows;
layout(binding = 9) uniform samplerCubeShadow cube_shadow;
struct Request {
    vec4 at;
    // And the level of detail.
    vec4 dx;
    // And the reference.
    vec4 dy;
};
layout(binding = 10, std430) readonly buffer Requests { Request requests[]; };
layout(binding = 11, std430) writeonly buffer Results { vec4 results[]; };
layout(push_constant) uniform Mode { uint kind; uint way; };

vec4 with_lod(Request r) {
    float lod = r.dx.w;
    switch (kind) {
    case 0: return textureLod(one, r.at.x, lod);
    case 1: return textureLod(two, r.at.xy, lod);
    case 2: return textureLod(three, r.at.xyz, lod);
    case 3: return textureLod(cube, r.at.xyz, lod);
    case 4: return textureLod(ones, r.at.xw, lod);
    case 5: return textureLod(twos, r.at.xyw, lod);
    case 6: return textureLod(cubes, r.at, lod);
    case 7: return vec4(textureLod(shadow, vec3(r.at.xy, r.dy.w), lod));
    }
    return vec4(0);
}

vec4 with_gradient(Request r) {
    switch (kind) {
    case 0: return textureGrad(one, r.at.x, r.dx.x, r.dy.x);
    case 1: return textureGrad(two, r.at.xy, r.dx.xy, r.dy.xy);
    case 2: return textureGrad(three, r.at.xyz, r.dx.xyz, r.dy.xyz);
    case 3: return textureGrad(cube, r.at.xyz, r.dx.xyz, r.dy.xyz);
    case 4: return textureGrad(ones, r.at.xw, r.dx.x, r.dy.x);
    case 5: return textureGrad(twos, r.at.xyw, r.dx.xy, r.dy.xy);
    case 6: return textureGrad(cubes, r.at, r.dx.xyz, r.dy.xyz);
    case 7: return vec4(textureGrad(shadow, vec3(r.at.xy, r.dy.w), r.dx.xy, r.dy.xy));
    case 8: return vec4(textureGrad(shadows, vec4(r.at.xyw, r.dy.w), r.dx.xy, r.dy.xy));
    case 9: return vec4(textureGrad(cube_shadow, vec4(r.at.xyz, r.dy.w), r.dx.xyz, r.dy.xyz));
    }
    return vec4(0);
}

vec4 gathered(Request r) {
    switch (kind) {
    case 1: return textureGather(two, r.at.xy, 1);
    case 3: return textureGather(cube, r.at.xyz, 1);
    case 5: return textureGather(twos, r.at.xyw, 1);
    case 6: return textureGather(cubes, r.at, 1);
    case 7: return textureGather(shadow, r.at.xy, r.dy.w);
    case 8: return textureGather(shadows, r.at.xyw, r.dy.w);
    case 9: return textureGather(cube_shadow, r.at.xyz, r.dy.w);
    }
    return vec4(0);
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    Request r = requests[i];
    results[i] = way == 0 ? with_lod(r) : way == 1 ? with_gradient(r) : gathered(r);
}
