#version 460
// One triangle over everything.
#ifdef VIEWS
#extension GL_EXT_multiview : require
// Drivers agree on it here; in fragment shaders some have another view's.
layout(location = 0) flat out uint view;
#endif

void main() {
#ifdef VIEWS
    view = gl_ViewIndex;
#endif
    gl_Position = vec4(gl_VertexIndex == 1 ? 3.0 : -1.0, gl_VertexIndex == 2 ? 3.0 : -1.0, 0.0, 1.0);
}
