#version 450
// Integer and packing functions: outputs are [function][lane].
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer In { uint a[64]; uint b[64]; vec4 v[64]; };
layout(set = 0, binding = 1) writeonly buffer Out { uint outputs[]; };
uint next = 0u;
void put(uint x) { outputs[64u * next++ + gl_LocalInvocationIndex] = x; }
void put(int x) { put(uint(x)); }
void put(float x) { put(floatBitsToUint(x)); }
void main() {
    uint i = gl_LocalInvocationIndex;
    uint x = a[i], y = b[i];
    int s = int(x), t = int(y);
    put(abs(s)); put(sign(s)); put(min(s, t)); put(max(s, t)); put(clamp(s, -9, 9)); put(min(x, y)); put(max(x, y)); put(clamp(x, 5u, 77u));
    put(findLSB(x)); put(findMSB(s)); put(findMSB(x)); put(bitCount(x)); put(bitfieldReverse(x));
    put(bitfieldExtract(s, int(y & 15u), 7)); put(bitfieldExtract(x, int(y & 15u), 7)); put(bitfieldInsert(x, y, 5, 9));
    uint carry, borrow, high, low; int shigh, slow;
    put(uaddCarry(x, y, carry)); put(carry); put(usubBorrow(x, y, borrow)); put(borrow);
    umulExtended(x, y, high, low); put(high); put(low); imulExtended(s, t, shigh, slow); put(shigh);
    put(x / (y | 1u)); put(x % (y | 1u)); put(s / (t | 1)); put(s >> 3); put(x >> (y & 31u)); put(~x); put(-s);
    put(packSnorm4x8(v[i])); put(packUnorm4x8(v[i])); put(packSnorm2x16(v[i].xy)); put(packUnorm2x16(v[i].xy)); put(packHalf2x16(v[i].xy));
    put(unpackSnorm4x8(x).y); put(unpackUnorm4x8(x).w); put(unpackSnorm2x16(x).x); put(unpackUnorm2x16(x).y); put(unpackHalf2x16(x & 0x3fff3fffu).y);
    put(unpackDouble2x32(packDouble2x32(uvec2(x, y)) ).y);
    put(uint(float(x))); put(int(float(s) / 4.0)); put(float(s)); put(uint(isnan(uintBitsToFloat(x))) + 2u * uint(isinf(uintBitsToFloat(x))));
}
