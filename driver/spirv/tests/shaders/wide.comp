#version 450
#extension GL_EXT_shader_explicit_arithmetic_types : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_8bit_storage : require
layout(local_size_x = 16) in;
layout(std430, set = 0, binding = 0) buffer Data {
    double d[16]; int64_t l[16]; uint64_t u[16]; float16_t h[16]; int16_t s[16]; uint8_t b[16]; int8_t c[16];
};
void main() {
    uint i = gl_LocalInvocationIndex;
    d[i] = sqrt(d[i]) * 2.0lf + double(i);
    l[i] = l[i] / int64_t(-3) + (int64_t(i) << 40);
    u[i] = u[i] * 0x100000001ul >> 3;
    h[i] = h[i] * float16_t(1.5) + float16_t(0.25);
    s[i] = int16_t(s[i] * int16_t(3));
    b[i] = uint8_t(b[i] + uint8_t(200));
    c[i] = int8_t(c[i] - int8_t(100));
}
