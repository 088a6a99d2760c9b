#version 450
layout(location = 0) in vec3 color;
layout(location = 1) in vec2 uv;
layout(location = 2) flat in int layer;
layout(location = 3) noperspective centroid in float fog;
layout(set = 0, binding = 1) uniform sampler2DArray textures;
layout(location = 0) out vec4 out_color;
layout(location = 1) out uint out_id;
void main() {
    vec4 texel = texture(textures, vec3(uv, layer));
    if (texel.a < 0.5) discard;
    vec2 slope = vec2(dFdx(fog), dFdy(fog)) + fwidth(uv.x);
    out_color = vec4(color * texel.rgb + vec3(slope, fog), 1.0);
    out_id = uint(layer) + (gl_FrontFacing ? 1u : 0u);
    gl_FragDepth = gl_FragCoord.z * 0.5;
}
