#version 460
#extension GL_ARB_shader_viewport_layer_array : require
layout(location = 0) out vec4 carried;
// A triangle over all of viewport 0 or 1 of layer 0 or 1.
void main() {
    vec2 corner = vec2(gl_VertexIndex == 1 ? 3.0 : -1.0, gl_VertexIndex == 2 ? 3.0 : -1.0);
    gl_Position = vec4(corner, 0.0, 1.0);
    gl_ViewportIndex = gl_InstanceIndex & 1;
    gl_Layer = gl_InstanceIndex >> 1;
    carried = vec4(gl_InstanceIndex + 1);
}
