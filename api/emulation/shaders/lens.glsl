// Distortion by a lens of places for focal lengths of 1, relative to the principal point, as pairs.

// Models, as src/lens.rs has them.
const uint NO_LENS = 0u, RATIONAL = 1u, POLYNOMIAL = 2u, POLYNOMIAL_FIRST = 3u, FIELD_OF_VIEW = 4u, DIVISION = 5u;

Lens lens_of_view() {
    return push.set.lenses.at[min(push.view, push.set.camera_count - 1u)];
}

vec2 square_of(vec2 u, vec2 v) {
    return add(mul(u, u), mul(v, v));
}

// Reports whether a place lies before the fold.
bool is_before_fold(Lens lens, vec2 u, vec2 v) {
    return sub(square_of(u, v), lens.fold).x < 0.0;
}

// 1 + k s + ... of coefficients from one on, and its derivative by s.
void polynomial(Lens lens, int first, int count, vec2 s, out vec2 value, out vec2 slope) {
    value = vec2(0.0);
    slope = vec2(0.0);
    for (int i = first + count - 1; i >= first; i--) {
        slope = add(mul(slope, s), value);
        value = add(mul(value, s), pair(lens.radial[i]));
    }
    slope = add(mul(slope, s), value);
    value = add(mul(value, s), pair(1.0));
}

// The factor of the radial part by the square of the radius, and its derivative.
void factor_of(Lens lens, vec2 s, out vec2 value, out vec2 slope) {
    if (lens.model == FIELD_OF_VIEW) {
        // The quotient of atan(x) and x; its derivative by x, divided by x.
        vec2 x = mul(lens.steepness, root(s)), square = mul(x, x), quotient, growth;
        if (x.x < 0.01) {
            const vec2 third = vec2(0.3333333432674408, -9.934107481068821e-09);
            float rest = square.x * square.x * (0.2 - square.x * 0.14285714);
            quotient = add(sub(pair(1.0), mul(square, third)), pair(rest));
            growth = add(mul(third, -2.0), pair(square.x * (0.8 - square.x * 0.85714286)));
        } else {
            quotient = div(angle_of(x, pair(1.0)), x);
            growth = div(sub(div(pair(1.0), add(pair(1.0), square)), quotient), square);
        }
        value = mul(lens.scale, quotient);
        slope = 0.5 * mul(mul(lens.scale, mul(lens.steepness, lens.steepness)), growth);
    } else if (lens.model == DIVISION) {
        vec2 under = root(sub(pair(1.0), mul(4.0 * s, lens.radial[0]))), sum = add(pair(1.0), under);
        value = div(pair(2.0), sum);
        slope = div(pair(4.0 * lens.radial[0]), mul(under, mul(sum, sum)));
    } else if (lens.model == RATIONAL) {
        vec2 n, n_slope, d, d_slope;
        polynomial(lens, 0, 3, s, n, n_slope);
        polynomial(lens, 3, 3, s, d, d_slope);
        value = div(n, d);
        slope = div(cross2(n_slope, d, n, d_slope), mul(d, d));
    } else {
        polynomial(lens, 0, 6, s, value, slope);
    }
}

// The distorted place of an ideal one, and its derivative by rows.
void distort(Lens lens, vec2 u, vec2 v, out vec2 x, out vec2 y, out vec2 by[4]) {
    vec2 value, slope;
    factor_of(lens, square_of(u, v), value, slope);
    x = mul(u, value);
    y = mul(v, value);
    by[0] = add(value, 2.0 * mul(mul(u, u), slope));
    by[1] = by[2] = 2.0 * mul(mul(u, v), slope);
    by[3] = add(value, 2.0 * mul(mul(v, v), slope));
    if (lens.model > POLYNOMIAL_FIRST) {
        return;
    }
    // The tangential part and the thin prism's.
    bool is_first = lens.model == POLYNOMIAL_FIRST;
    vec2 a = is_first ? x : u, b = is_first ? y : v, aa = mul(a, a), bb = mul(b, b), ab = mul(a, b), q = add(aa, bb);
    float p1 = lens.tangential[0], p2 = lens.tangential[1];
    float s1 = lens.thin_prism[0], s2 = lens.thin_prism[1], s3 = lens.thin_prism[2], s4 = lens.thin_prism[3];
    vec2 prism_x = add(pair(s1), mul(q, s2)), prism_y = add(pair(s3), mul(q, s4));
    vec2 beside_x = add(add(2.0 * mul(ab, p1), mul(add(q, 2.0 * aa), p2)), mul(q, prism_x));
    vec2 beside_y = add(add(mul(add(q, 2.0 * bb), p1), 2.0 * mul(ab, p2)), mul(q, prism_y));
    vec2 slope_x = add(pair(s1), 2.0 * mul(q, s2)), slope_y = add(pair(s3), 2.0 * mul(q, s4));
    vec2 along_a = mul(a, p1), along_b = mul(b, p1), across_a = mul(a, p2), across_b = mul(b, p2);
    vec2 mixed = 2.0 * add(along_a, across_b);
    vec2 own[4];
    own[0] = add(add(2.0 * along_b, mul(across_a, 6.0)), 2.0 * mul(a, slope_x));
    own[1] = add(mixed, 2.0 * mul(b, slope_x));
    own[2] = add(mixed, 2.0 * mul(a, slope_y));
    own[3] = add(add(mul(along_b, 6.0), 2.0 * across_a), 2.0 * mul(b, slope_y));
    if (is_first) {
        vec2 before[4] = by, after[4] = own;
        for (int r = 0; r < 2; r++) {
            for (int c = 0; c < 2; c++) {
                own[r * 2 + c] = add(mul(after[r * 2], before[c]), mul(after[r * 2 + 1], before[2 + c]));
            }
        }
    }
    x = add(x, beside_x);
    y = add(y, beside_y);
    for (int j = 0; j < 4; j++) {
        by[j] = add(by[j], own[j]);
    }
}
