// The workgroup's size and three constants are given when the pipeline is created.
#version 450
layout(local_size_x_id = 0) in;
layout(constant_id = 1) const uint addend = 5;
layout(constant_id = 2) const float factor = 1.0;
layout(constant_id = 3) const bool negate = false;
layout(set = 0, binding = 0) writeonly buffer Out { float values[]; } target;
shared float scratch[addend];
void main() {
    float value = float(gl_LocalInvocationIndex + addend) * factor;
    scratch[gl_LocalInvocationIndex % addend] = value;
    target.values[gl_GlobalInvocationID.x] = negate ? -value : value;
    if (gl_GlobalInvocationID.x == 0) target.values[63] = float(gl_WorkGroupSize.x);
}
