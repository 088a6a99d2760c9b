// Angles as pairs.

const vec2 HALF_PI = vec2(1.5707963705062866, -4.371138828673793e-08), PI = vec2(3.1415927410125732, -8.742277657347586e-08);
const vec2 STEP = vec2(0.09817477315664291, -2.7319617679211206e-09); // pi / 32

// Cosine and sine of multiples of pi / 32.
const vec4 TURNS[9] = vec4[9](
    vec4(1.0, 0.0, 0.0, 0.0),
    vec4(0.9951847195625305, 7.1096666331982306e-09, 0.0980171412229538, -8.933931927579408e-10),
    vec4(0.9807852506637573, 2.9739473106360492e-08, 0.19509032368659973, -1.6704715388726754e-09),
    vec4(0.9569403529167175, -1.7184508038781132e-08, 0.290284663438797, 1.3815665056426951e-08),
    vec4(0.9238795042037964, 2.830748968563057e-08, 0.3826834261417389, 6.2233507236442165e-09),
    vec4(0.8819212913513184, -2.7002963420841297e-08, 0.4713967442512512, -7.425253745196869e-09),
    vec4(0.8314695954322815, 1.687026340846387e-08, 0.5555702447891235, -1.1769521357507529e-08),
    vec4(0.7730104327201843, 2.0642552556182636e-08, 0.6343932747840881, 9.37955757507325e-09),
    vec4(0.7071067690849304, 1.2101617485882343e-08, 0.7071067690849304, 1.2101617485882343e-08));

// The angle of a point from the axis of x: from -pi to pi, and 0 at the origin.
vec2 angle_of(vec2 y, vec2 x) {
    vec2 width = x.x < 0.0 ? -x : x, height = y.x < 0.0 ? -y : y;
    bool is_steep = height.x > width.x;
    vec2 shorter = is_steep ? width : height, longer = is_steep ? height : width;
    if (longer.x == 0.0) {
        return vec2(0.0);
    }
    // By the nearest multiple the tangent of the rest is at most 0.05.
    vec2 tangent = div(shorter, longer);
    int near = clamp(int(atan(tangent.x) * 10.18591636 + 0.5), 0, 8);
    vec2 cosine = TURNS[near].xy, sine = TURNS[near].zw;
    vec2 rest = div(sub(mul(tangent, cosine), sine), add(cosine, mul(tangent, sine)));
    // The series without its first term: less than 5e-5, with an error of 1e-11.
    float square = rest.x * rest.x;
    float more = rest.x * square * (-0.33333333 + square * (0.2 + square * (-0.14285714 + square * 0.11111111)));
    vec2 angle = add(mul(STEP, float(near)), add(rest, pair(more)));
    angle = is_steep ? sub(HALF_PI, angle) : angle;
    angle = x.x < 0.0 ? sub(PI, angle) : angle;
    return y.x < 0.0 ? -angle : angle;
}
