#version 460
layout(location = 0) in vec2 elements[6];
layout(location = 6) in vec4 v;
layout(location = 7) flat in int which;
layout(location = 8) flat in vec2 offset;
layout(location = 0) out vec4 a;
layout(location = 1) out vec4 b;
layout(location = 2) out vec4 c;
void main() {
    a = vec4(interpolateAtOffset(elements[which], offset), interpolateAtOffset(elements[which].y, offset),
             interpolateAtOffset(v.z, offset));
    b = vec4(interpolateAtSample(elements[which], 2), interpolateAtCentroid(elements[which]));
    c = vec4(interpolateAtOffset(v.wz, offset), interpolateAtCentroid(v).yx);
}
