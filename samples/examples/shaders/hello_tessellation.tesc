#version 450
// The left half of the ball is divided coarsely, the right half finely.
layout(vertices = 3) out;
void main() {
    vec4 corner = gl_in[gl_InvocationID].gl_Position;
    gl_out[gl_InvocationID].gl_Position = corner;
    // The level of an edge depends on its two corners alone, so that neighbours agree and leave no cracks.
    vec3 edge = gl_in[(gl_InvocationID + 1) % 3].gl_Position.xyz + gl_in[(gl_InvocationID + 2) % 3].gl_Position.xyz;
    gl_TessLevelOuter[gl_InvocationID] = 7.0 + 5.0 * edge.x;
    vec3 middle = gl_in[0].gl_Position.xyz + gl_in[1].gl_Position.xyz + gl_in[2].gl_Position.xyz;
    gl_TessLevelInner[0] = 7.0 + 10.0 / 3.0 * middle.x;
}
