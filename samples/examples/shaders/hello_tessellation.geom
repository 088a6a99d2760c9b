#version 450
// Numbers the corners of each triangle, so that the fragment shader knows how far the edges are.
layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;
layout(location = 0) in vec3 normal[];
layout(location = 0) out vec3 carried_normal;
layout(location = 1) out vec3 corner;
void main() {
    for (int i = 0; i < 3; i++) {
        gl_Position = gl_in[i].gl_Position;
        carried_normal = normal[i];
        corner = vec3(i == 0, i == 1, i == 2);
        EmitVertex();
    }
}
