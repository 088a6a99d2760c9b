#version 450
// Each float function of GLSL.std.450 once: outputs are [function][lane].
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer In { float a[64]; float b[64]; float c[64]; };
layout(set = 0, binding = 1) writeonly buffer Out { float outputs[]; };
uint next = 0u;
void put(float x) { outputs[64u * next++ + gl_LocalInvocationIndex] = x; }
void main() {
    uint i = gl_LocalInvocationIndex;
    float x = a[i], y = b[i], z = c[i];
    float part;
    int exponent;
    put(round(x)); put(roundEven(x)); put(trunc(x)); put(abs(x)); put(sign(x)); put(floor(x)); put(ceil(x)); put(fract(x));
    put(radians(x)); put(degrees(x)); put(sin(x)); put(cos(x)); put(tan(x));
    put(asin(x / 8.0)); put(acos(x / 8.0)); put(atan(x)); put(sinh(x)); put(cosh(x)); put(tanh(x));
    put(asinh(x)); put(acosh(abs(x) + 1.0)); put(atanh(x / 9.0)); put(atan(x, y)); put(pow(abs(x), y));
    put(exp(x)); put(log(abs(x) + 0.1)); put(exp2(x)); put(log2(abs(x) + 0.1)); put(sqrt(abs(x))); put(inversesqrt(abs(x) + 0.1));
    put(modf(x, part)); put(part); put(min(x, y)); put(max(x, y)); put(clamp(x, -1.0, z)); put(mix(x, y, z)); put(step(x, y));
    put(smoothstep(-2.0, 3.0, x)); put(fma(x, y, z)); put(frexp(x, exponent)); put(float(exponent)); put(ldexp(x, int(y)));
    put(length(vec3(x, y, z))); put(distance(vec3(x, y, z), vec3(1, 2, 3))); put(cross(vec3(x, y, z), vec3(1, 2, 3)).y);
    put(normalize(vec3(x, y, z)).x); put(faceforward(vec2(x, y), vec2(z, x), vec2(1, 2)).x); put(reflect(vec2(x, y), vec2(0.6, 0.8)).y);
    put(refract(normalize(vec2(x, y)), vec2(0.6, 0.8), 0.5).x);
    put(determinant(mat4(x, y, z, 1, y, x, 2, z, 1, 2, x, y, z, 1, y, 3)));
    put(inverse(mat3(x + 20.0, y, z, 1, y + 30.0, 2, x, 1, 25))[1][2]);
    put(mod(x, y + 5.0)); put(x - y * trunc(x / y)); put(dot(vec4(x, y, z, 1), vec4(z, y, x, 2)));
}
