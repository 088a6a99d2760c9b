#version 450
// Writes a depth that breaks the promise of being the primitive's.
layout(depth_unchanged) out float gl_FragDepth;
layout(location = 0) in vec4 value;
layout(location = 0) out vec4 color;
void main() {
    color = value;
    gl_FragDepth = 0.7;
}
