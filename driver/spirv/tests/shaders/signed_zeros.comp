#version 450
// Minima, maxima and fractions, whose zeros have signs.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer First { float first[]; };
layout(set = 0, binding = 1) readonly buffer Second { float second[]; };
layout(set = 0, binding = 2) writeonly buffer Results { float results[]; };

void main() {
    uint lane = gl_LocalInvocationIndex;
    float a = first[lane], b = second[lane], whole;
    results[lane] = min(a, b);
    results[64 + lane] = max(a, b);
    results[128 + lane] = modf(a, whole);
}
