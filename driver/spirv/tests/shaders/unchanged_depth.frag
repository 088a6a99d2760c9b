#version 450
// The depth breaks the promise that it is the primitive's.
layout(depth_unchanged) out float gl_FragDepth;
layout(location = 0) in vec4 value;
layout(location = 0) out vec4 color;
void main() {
    color = value;
    gl_FragDepth = 0.7;
}
