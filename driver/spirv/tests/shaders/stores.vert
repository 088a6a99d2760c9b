#version 460
layout(location = 0) in vec4 position;
layout(location = 1) in vec4 color;
layout(set = 0, binding = 0) buffer Counts { uint vertices; uint fragments; uint slots[]; } counts;
layout(location = 0) out vec4 carried;
void main() {
    gl_Position = position;
    counts.slots[gl_VertexIndex] = gl_VertexIndex + 7;
    atomicAdd(counts.vertices, 1);
    carried = color;
}
