#version 450
// A resolve shader that maps tones, and outputs depths and pixel positions.

layout(location = 2) in vec4 accumulated;
layout(location = 5) in vec2 depths;

layout(location = 0) out vec4 color;
layout(location = 1) out vec4 shown;

void main() {
    color = vec4(accumulated.rgb / (1.0 + accumulated.rgb), accumulated.a);
    shown = vec4(depths, gl_FragCoord.xy);
}
