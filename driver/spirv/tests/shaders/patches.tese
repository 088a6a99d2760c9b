#version 450
layout(quads, fractional_even_spacing, cw) in;
layout(location = 0) in vec4 carried[];
layout(location = 1) patch in Whole { float list[3]; mat2 turn; } whole;
layout(location = 0) out vec4 color;
void main() {
    vec4 sum = vec4(0.0);
    for (int i = 0; i < gl_PatchVerticesIn; i++) sum += gl_in[i].gl_Position * carried[i].x;
    gl_Position = mix(sum, gl_in[0].gl_Position, gl_TessCoord.x);
    color = vec4(whole.turn * gl_TessCoord.xy, whole.list[gl_PrimitiveID % 3], gl_TessLevelOuter[1]);
}
