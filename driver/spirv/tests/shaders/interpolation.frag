#version 450
layout(location = 0) in vec4 v;
layout(location = 1) noperspective in vec2 w;
layout(location = 0) out vec4 color;
layout(input_attachment_index = 1, set = 0, binding = 0) uniform subpassInput before;
layout(early_fragment_tests) in;
void main() {
    color = interpolateAtCentroid(v) + interpolateAtOffset(v, vec2(0.25, -0.25));
    color.xy += interpolateAtSample(w, 0) + subpassLoad(before).zw;
    if (gl_HelperInvocation) color.w = 2.0;
}
