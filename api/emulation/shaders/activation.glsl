// The functions of logarithms and logits, as integers of 64 bits, low half first: their results are the nearest binary32 numbers, or
// either of two whose middle is nearer than 2^-30 of their distance.

// Reciprocals of factorials, in units of 2^-62.
const uvec2 FACTORS[18] = uvec2[18](
    uvec2(0x00000000u, 0x40000000u), uvec2(0x00000000u, 0x40000000u), uvec2(0x00000000u, 0x20000000u), uvec2(0xaaaaaaabu, 0x0aaaaaaau),
    uvec2(0xaaaaaaabu, 0x02aaaaaau), uvec2(0x88888889u, 0x00888888u), uvec2(0x16c16c17u, 0x0016c16cu), uvec2(0x03403403u, 0x00034034u),
    uvec2(0x80680680u, 0x00006806u), uvec2(0xf1d2ab64u, 0x00000b8eu), uvec2(0xe4fb778au, 0x00000127u), uvec2(0xe64567f5u, 0x0000001au),
    uvec2(0x3ddb1dffu, 0x00000002u), uvec2(0x2c248c27u, 0x00000000u), uvec2(0x03272e95u, 0x00000000u), uvec2(0x0035cfe8u, 0x00000000u),
    uvec2(0x00035cfeu, 0x00000000u), uvec2(0x000032a6u, 0x00000000u));
// log(2) in units of 2^-64.
const uvec2 LOG_2 = uvec2(0xd1cf79abu, 0xb17217f7u);

uvec2 sum64(uvec2 a, uvec2 b) {
    uint carry, low = uaddCarry(a.x, b.x, carry);
    return uvec2(low, a.y + b.y + carry);
}

uvec2 difference64(uvec2 a, uvec2 b) {
    uint borrow, low = usubBorrow(a.x, b.x, borrow);
    return uvec2(low, a.y - b.y - borrow);
}

uvec2 left64(uvec2 a, uint by) {
    if (by == 0u) {
        return a;
    }
    return by >= 64u ? uvec2(0u) : by >= 32u ? uvec2(0u, a.x << by - 32u) : uvec2(a.x << by, a.y << by | a.x >> 32u - by);
}

uvec2 right64(uvec2 a, uint by) {
    if (by == 0u) {
        return a;
    }
    return by >= 64u ? uvec2(0u) : by >= 32u ? uvec2(a.y >> by - 32u, 0u) : uvec2(a.x >> by | a.y << 32u - by, a.y >> by);
}

// The upper half of a product, one or two units low at most.
uvec2 upper_product(uvec2 a, uvec2 b) {
    uint unused, low_high, high_low;
    uvec2 high;
    umulExtended(a.y, b.y, high.y, high.x);
    umulExtended(a.x, b.y, low_high, unused);
    umulExtended(a.y, b.x, high_low, unused);
    uint middle_1 = a.x * b.y, middle_2 = a.y * b.x, carry;
    uaddCarry(middle_1, middle_2, carry);
    return sum64(sum64(high, uvec2(low_high, 0u)), sum64(uvec2(high_low, 0u), uvec2(carry, 0u)));
}

// The binary32 number nearest to `value` 2^`power`.
float nearest_float(uvec2 value, int power) {
    if (value == uvec2(0u)) {
        return 0.0;
    }
    uint empty = value.y != 0u ? 31u - uint(findMSB(value.y)) : 63u - uint(findMSB(value.x));
    value = left64(value, empty);
    // Now it is from 2^63 on; its exponent is that of its first bit.
    int exponent = power + 63 - int(empty);
    if (exponent > 127) {
        return uintBitsToFloat(0x7f800000u);
    }
    if (exponent < -150) {
        return 0.0;
    }
    uint dropped = 40u + (exponent < -126 ? uint(-126 - exponent) : 0u);
    uvec2 kept = right64(value, dropped), rest = left64(value, 64u - dropped);
    uint up = rest.y > 0x80000000u || (rest.y == 0x80000000u && (rest.x != 0u || (kept.x & 1u) != 0u)) ? 1u : 0u;
    // The first bit of 24 adds one to the exponent, as does a carry.
    uint base = exponent < -126 ? 0u : uint(exponent + 126) << 23;
    return uintBitsToFloat(base + kept.x + up);
}

// x in units of 2^-64, modulo 1.
uvec2 fixed_of(float x) {
    uint bits = floatBitsToUint(x), mantissa = bits & 0x7fffffu, biased = bits >> 23 & 0xffu;
    mantissa |= biased == 0u ? 0u : 0x800000u;
    int shift = int(max(biased, 1u)) - 150 + 64;
    uvec2 magnitude = shift >= 0 ? left64(uvec2(mantissa, 0u), uint(shift)) : right64(uvec2(mantissa, 0u), uint(-shift));
    return bits >> 31 != 0u ? difference64(uvec2(0u), magnitude) : magnitude;
}

// The sum of a^n / (n + `first`)!, in units of 2^-62, of an a in units of 2^-64.
uvec2 series(uvec2 a, int first) {
    uvec2 value = FACTORS[17];
    for (int n = 16; n >= first; n--) {
        value = sum64(FACTORS[n], upper_product(a, value));
    }
    return value;
}

// e^x as `value` 2^(`power` - 62), of a pair from -110 to 110.
void power_of_e(vec2 x, out uvec2 value, out int power) {
    power = int(floor(x.x * 1.44269504 - 0.001));
    // What is left of x without the logarithm of 2^power.
    uvec2 fixed_ = sum64(fixed_of(x.x), fixed_of(x.y));
    uint whole = uint(abs(power)), high, low;
    umulExtended(LOG_2.x, whole, high, low);
    uvec2 multiple = uvec2(low, high + LOG_2.y * whole);
    uvec2 rest = power < 0 ? sum64(fixed_, multiple) : difference64(fixed_, multiple);
    value = series(rest, 0);
}

// A pair, or the bound that it is beyond.
vec2 bounded(vec2 x) {
    return abs(x.x) < 110.0 ? x : vec2(clamp(x.x, -110.0, 110.0), 0.0);
}

float scale_of_logarithm(vec2 x) {
    if (isnan(x.x)) {
        return x.x;
    }
    uvec2 value;
    int power;
    power_of_e(bounded(x), value, power);
    return nearest_float(value, power - 62);
}

// sgn(x) (e^|x| - 1).
float number_of_signed_logarithm(vec2 x) {
    if (isnan(x.x)) {
        return x.x;
    }
    vec2 a = bounded(x.x < 0.0 ? -x : x);
    float number;
    if (a.x < 0.25) {
        uvec2 value = series(sum64(fixed_of(a.x), fixed_of(a.y)), 1);
        vec2 quotient = quick_two_sum(ldexp(float(value.y >> 8), -22), ldexp(float((value.y & 255u) << 16 | value.x >> 16), -46));
        number = whole_mul(a, quotient).x;
    } else {
        uvec2 value;
        int power;
        power_of_e(a, value, power);
        number = nearest_float(difference64(value, right64(FACTORS[0], uint(max(power, 0)))), power - 62);
    }
    return x.x < 0.0 ? -number : number;
}

float opacity_of_logit(vec2 x) {
    if (isnan(x.x)) {
        return x.x;
    }
    uvec2 value;
    int power;
    power_of_e(bounded(x.x < 0.0 ? x : -x), value, power);
    // 1 + t, in units of 2^-62, and its reciprocal, in units of 2^-63.
    uvec2 sum = sum64(FACTORS[0], right64(value, uint(-power)));
    float first = 1.0 / (float(sum.y) * 9.313225746154785e-10);
    uvec2 inverse = uvec2(0u, uint(first * 2147483520.0));
    for (int k = 0; k < 3; k++) {
        uvec2 error = difference64(uvec2(0u, 0x40000000u), upper_product(sum, inverse));
        inverse = left64(upper_product(inverse, error), 3u);
    }
    return x.x < 0.0 ? nearest_float(upper_product(value, inverse), power - 61) : nearest_float(inverse, -63);
}
