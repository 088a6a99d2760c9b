#version 450
// The resolve shader that shows some of its inputs: those of a number.

layout(constant_id = 0) const int SHOWN = 0;

layout(location = 0) in vec4 accumulated; // Premultiplied.
layout(location = 1) in vec2 depth; // The expected and the median one.
layout(location = 2) in vec2 linear_depth; // The same of the depth variable.
layout(location = 3) flat in uvec2 median; // Vertex and instance.
layout(location = 4) flat in uvec2 nearest;
layout(location = 5) flat in mat3x4 view; // A column is a row of the matrix from world to camera axes.
layout(location = 8) flat in vec4 lens;
layout(location = 9) flat in vec4 planes;
layout(location = 10) flat in vec4 eye;

layout(location = 0) out vec4 color;

void main() {
    switch (SHOWN) {
    case 0: color = accumulated; break;
    case 1: color = vec4(depth, 0.0, 1.0); break;
    case 2: color = vec4(linear_depth, 0.0, 1.0); break;
    case 3: color = vec4(median, nearest); break;
    case 4: color = view[0]; break;
    case 5: color = view[1]; break;
    case 6: color = view[2]; break;
    case 7: color = lens; break;
    case 8: color = planes; break;
    default: color = eye; break;
    }
}
