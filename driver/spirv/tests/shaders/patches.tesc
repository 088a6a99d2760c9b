#version 450
layout(vertices = 5) out;
layout(location = 0) in vec4 color[];
layout(location = 0) out vec4 carried[];
layout(location = 1) patch out Whole { float list[3]; mat2 turn; } whole;
void main() {
    int from = gl_InvocationID % gl_PatchVerticesIn;
    gl_out[gl_InvocationID].gl_Position = gl_in[from].gl_Position;
    carried[gl_InvocationID] = color[from];
    barrier();
    if (gl_InvocationID < 3) whole.list[gl_InvocationID] = carried[4 - gl_InvocationID].g;
    whole.turn = mat2(float(gl_PrimitiveID));
    barrier();
    gl_TessLevelOuter[gl_InvocationID & 3] = whole.list[gl_InvocationID % 3];
    gl_TessLevelInner[0] = 3.0;
}
