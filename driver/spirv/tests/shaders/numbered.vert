#version 460
layout(location = 0) in uvec2 cell;
layout(location = 0) out vec4 carried;
const vec2 CORNERS[4] = vec2[](vec2(0, 0), vec2(1, 0), vec2(0, 1), vec2(1, 1));
// A quad for each instance, in a cell of a grid of four by four; blue has the number of the draw.
void main() {
    vec2 corner = CORNERS[(gl_VertexIndex - gl_BaseVertex) & 3];
    gl_Position = vec4((vec2(cell) + corner) * 0.5 - 1.0, 0.0, 1.0);
    carried = vec4(gl_InstanceIndex, gl_BaseInstance, gl_DrawID, 1.0);
}
