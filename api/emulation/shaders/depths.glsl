// The depth of a centre, before the viewport's range, as the attachment holds it: in steps, if it has steps.
float held(vec2 d) {
    if (push.set.is_negative_one_to_one != 0u) {
        d = add(0.5 * d, pair(0.5));
    }
    d = sub(d, pair(1.0)).x >= 0.0 ? pair(1.0) : d.x <= 0.0 ? pair(0.0) : d;
    float nearest = push.set.depth_range.x;
    d = add(pair(nearest), mul(d, two_sum(push.set.depth_range.y, -nearest)));
    if (push.set.depth_steps == 0u) {
        return d.x;
    }
    d = mul(d, float(push.set.depth_steps));
    precise float whole = roundEven(d.x);
    precise float rest = (d.x - whole) + d.y;
    return rest > 0.5 ? whole + 1.0 : rest < -0.5 ? whole - 1.0 : whole;
}

// The depth of a centre as the attachment holds it.
float held_depth(Camera camera, float z) {
    float c0 = camera.depth_coefficients.x, c1 = camera.depth_coefficients.y;
    float rough = camera.model == ORTHOGRAPHIC ? c0 + c1 * z : c0 + c1 / z;
    vec2 d;
    if (abs(rough) < 4.0) {
        d = add(pair(c0), camera.model == ORTHOGRAPHIC ? two_product(c1, z) : div(pair(c1), pair(z)));
    } else {
        d = pair(rough > 0.0 ? 4.0 : -4.0);
    }
    return held(d);
}
