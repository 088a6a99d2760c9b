#version 450
// An attribute of 64 bits.
layout(location = 0) in dvec2 place;
void main() {
    gl_Position = vec4(place, 0.0, 1.0);
}
