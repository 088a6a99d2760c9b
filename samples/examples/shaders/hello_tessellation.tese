#version 450
// A point of a patch, moved to the ball.
layout(triangles, fractional_odd_spacing, ccw) in;
layout(location = 0) out vec3 normal;
void main() {
    vec3 corner = gl_TessCoord.x * gl_in[0].gl_Position.xyz + gl_TessCoord.y * gl_in[1].gl_Position.xyz
        + gl_TessCoord.z * gl_in[2].gl_Position.xyz;
    normal = normalize(corner);
    gl_Position = vec4(0.9 * normal.xy, 0.5 - 0.5 * normal.z, 1.0);
}
