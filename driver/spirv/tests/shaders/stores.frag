#version 460
layout(location = 0) in vec4 carried;
layout(set = 0, binding = 0) buffer Counts { uint vertices; uint fragments; uint slots[]; } counts;
layout(location = 0) out vec4 color;
void main() {
    atomicAdd(counts.fragments, 1);
    if (gl_FragCoord.x < 8.0) discard;
    color = carried;
}
