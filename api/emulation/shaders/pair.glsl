// Numbers as sums of two binary32: x is the sum, rounded, and y is the rest. Sums and products are Knuth's and Dekker's, of operations
// that round to nearest. Every operation is `precise`: a compiler that contracts or reorders one makes the rest wrong.

// True if numbers are binary32 alone: rests are 0, but for functions whose names begin with `whole`.
layout(constant_id = 31) const bool IS_RELAXED = false;

vec2 whole_two_sum(float a, float b) {
    precise float s = a + b;
    precise float t = s - a;
    precise float e = (a - (s - t)) + (b - t);
    return vec2(s, e);
}

vec2 two_sum(float a, float b) {
    if (IS_RELAXED) {
        precise float only = a + b;
        return vec2(only, 0.0);
    }
    return whole_two_sum(a, b);
}

// The same, for |a| >= |b|.
vec2 quick_two_sum(float a, float b) {
    precise float s = a + b;
    precise float e = b - (s - a);
    return vec2(s, e);
}

// Halves of 12 bits each. There is no fma: it need not be fused.
vec2 split(float a) {
    precise float t = 4097.0 * a;
    precise float high = t - (t - a);
    precise float low = a - high;
    return vec2(high, low);
}

vec2 whole_two_product(float a, float b) {
    precise float p = a * b;
    vec2 x = split(a), y = split(b);
    precise float e = ((x.x * y.x - p) + x.x * y.y + x.y * y.x) + x.y * y.y;
    return vec2(p, e);
}

vec2 two_product(float a, float b) {
    if (IS_RELAXED) {
        precise float only = a * b;
        return vec2(only, 0.0);
    }
    return whole_two_product(a, b);
}

vec2 whole_add(vec2 a, vec2 b) {
    vec2 s = whole_two_sum(a.x, b.x), t = whole_two_sum(a.y, b.y);
    precise float y = s.y + t.x;
    s = quick_two_sum(s.x, y);
    precise float z = s.y + t.y;
    return quick_two_sum(s.x, z);
}

vec2 add(vec2 a, vec2 b) {
    if (IS_RELAXED) {
        precise float only = a.x + b.x;
        return vec2(only, 0.0);
    }
    return whole_add(a, b);
}

vec2 sub(vec2 a, vec2 b) {
    return add(a, -b);
}

vec2 whole_mul(vec2 a, vec2 b) {
    vec2 p = whole_two_product(a.x, b.x);
    precise float e = p.y + (a.x * b.y + a.y * b.x);
    return quick_two_sum(p.x, e);
}

vec2 mul(vec2 a, vec2 b) {
    if (IS_RELAXED) {
        precise float only = a.x * b.x;
        return vec2(only, 0.0);
    }
    return whole_mul(a, b);
}

vec2 mul(vec2 a, float b) {
    if (IS_RELAXED) {
        precise float only = a.x * b;
        return vec2(only, 0.0);
    }
    vec2 p = two_product(a.x, b);
    precise float e = p.y + a.y * b;
    return quick_two_sum(p.x, e);
}

vec2 whole_div(vec2 a, vec2 b) {
    precise float q = a.x / b.x;
    vec2 r = whole_add(a, -whole_mul(b, vec2(q, 0.0)));
    precise float q2 = r.x / b.x;
    r = whole_add(r, -whole_mul(b, vec2(q2, 0.0)));
    precise float q3 = r.x / b.x;
    return whole_add(quick_two_sum(q, q2), vec2(q3, 0.0));
}

vec2 div(vec2 a, vec2 b) {
    if (IS_RELAXED) {
        precise float only = a.x / b.x;
        return vec2(only, 0.0);
    }
    return whole_div(a, b);
}

// The square root; 0 of what is not positive.
vec2 whole_root(vec2 a) {
    if (!(a.x > 0.0)) {
        return vec2(0.0);
    }
    float x = inversesqrt(a.x);
    precise float y = a.x * x;
    vec2 r = whole_add(a, -whole_two_product(y, y));
    precise float c = 0.5 * r.x * x;
    vec2 s = quick_two_sum(y, c);
    r = whole_add(a, -whole_mul(s, s));
    precise float d = 0.5 * r.x * x;
    return whole_add(s, vec2(d, 0.0));
}

vec2 root(vec2 a) {
    if (IS_RELAXED) {
        return a.x > 0.0 ? vec2(sqrt(a.x), 0.0) : vec2(0.0);
    }
    return whole_root(a);
}

vec2 pair(float a) {
    return vec2(a, 0.0);
}

vec2 dot3(vec2 a0, vec2 a1, vec2 a2, vec2 b0, vec2 b1, vec2 b2) {
    return add(add(mul(a0, b0), mul(a1, b1)), mul(a2, b2));
}

// a b - c d.
vec2 cross2(vec2 a, vec2 b, vec2 c, vec2 d) {
    return sub(mul(a, b), mul(c, d));
}

// A binary64 number as the sum of three binary32.
vec3 in_three(uvec2 bits) {
    int exponent = int(bits.y >> 20 & 0x7ffu);
    if (exponent == 0) {
        return vec3(0.0);
    }
    // 53 bits: 24, 24 and 5.
    uint top = 0x100000u | bits.y & 0xfffffu;
    uint high = top << 3 | bits.x >> 29, middle = bits.x >> 5 & 0xffffffu, low = bits.x & 31u;
    int e = exponent - 1075;
    vec3 value = vec3(ldexp(float(high), e + 29), ldexp(float(middle), e + 5), ldexp(float(low), e));
    return bits.y >> 31 != 0u ? -value : value;
}
