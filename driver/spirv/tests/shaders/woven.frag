#version 450
// A resolve shader that discards every other pixel, and outputs derivatives.

layout(location = 0) in vec4 accumulated;
layout(location = 0) out vec4 color;

layout(push_constant) uniform Tint {
    layout(offset = 96) vec4 tint;
};

void main() {
    vec2 across = vec2(dFdx(gl_FragCoord.x), dFdy(gl_FragCoord.y));
    float slope = dFdxFine(accumulated.a);
    if ((int(gl_FragCoord.x) + int(gl_FragCoord.y)) % 2 == 1) {
        discard;
    }
    color = vec4(across, slope, accumulated.a) * tint;
}
