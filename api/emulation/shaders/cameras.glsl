// Pixels of points in a camera's axes, in units of the focal length from the principal point, and their derivatives, as pairs.

// The angle from the axis by the distance from it. Near the axis it has a limit.
vec2 angle_by_radius(vec2 t[3], vec2 square) {
    vec2 radius = root(square);
    bool is_near = t[2].x > 0.0 && radius.x <= 1e-9 * t[2].x;
    return is_near ? div(pair(1.0), t[2]) : div(angle_of(radius, t[2]), radius);
}

void pixel_of(int model, vec2 t[3], out vec2 u, out vec2 v) {
    u = t[0];
    v = t[1];
    if (HAS_ANGLES && model == FISHEYE) {
        vec2 scale = angle_by_radius(t, add(mul(t[0], t[0]), mul(t[1], t[1])));
        u = mul(scale, t[0]);
        v = mul(scale, t[1]);
    } else if (HAS_ANGLES && model == EQUIRECTANGULAR) {
        u = angle_of(t[0], t[2]);
        v = angle_of(t[1], root(add(mul(t[0], t[0]), mul(t[2], t[2]))));
    } else if (model == PINHOLE) {
        u = div(t[0], t[2]);
        v = div(t[1], t[2]);
    }
}

// The derivative of a fisheye's or a panorama's pixel, by rows.
void derivative_of(int model, vec2 t[3], out vec2 derivative[6]) {
    vec2 squares = dot3(t[0], t[1], t[2], t[0], t[1], t[2]);
    if (model == FISHEYE) {
        vec2 square = add(mul(t[0], t[0]), mul(t[1], t[1])), scale = angle_by_radius(t, square);
        // What the scale grows by with the radius, by the radius.
        bool is_near = t[2].x > 0.0 && root(square).x <= 1e-9 * t[2].x;
        vec2 growth = is_near ? vec2(0.0) : div(sub(div(t[2], squares), scale), square);
        vec2 both = mul(growth, mul(t[0], t[1]));
        derivative[0] = add(scale, mul(growth, mul(t[0], t[0])));
        derivative[1] = both;
        derivative[2] = -div(t[0], squares);
        derivative[3] = both;
        derivative[4] = add(scale, mul(growth, mul(t[1], t[1])));
        derivative[5] = -div(t[1], squares);
    } else {
        vec2 radius = root(add(mul(t[0], t[0]), mul(t[2], t[2]))), least = mul(root(squares), 0.0009765625);
        vec2 bounded = radius.x < least.x ? least : radius;
        vec2 sine = radius.x == 0.0 ? vec2(0.0) : div(t[0], radius), cosine = radius.x == 0.0 ? pair(1.0) : div(t[2], radius);
        vec2 rise = div(t[1], squares);
        derivative[0] = div(cosine, bounded);
        derivative[1] = vec2(0.0);
        derivative[2] = -div(sine, bounded);
        derivative[3] = -mul(rise, sine);
        derivative[4] = div(radius, squares);
        derivative[5] = -mul(rise, cosine);
    }
}

// The angle between two directions.
vec2 angle_between(vec2 a[3], vec2 b[3]) {
    vec2 x = cross2(a[1], b[2], a[2], b[1]), y = cross2(a[2], b[0], a[0], b[2]), z = cross2(a[0], b[1], a[1], b[0]);
    return angle_of(root(dot3(x, y, z, x, y, z)), dot3(a[0], a[1], a[2], b[0], b[1], b[2]));
}

// Reports whether a sigma point is seen, of a Gaussian at `t`.
bool is_seen(int model, float near_plane, vec2 t[3], vec2 point[3]) {
    if (HAS_ANGLES && model == FISHEYE) {
        vec2 between = angle_between(point, t), axis = angle_of(root(add(mul(t[0], t[0]), mul(t[1], t[1]))), t[2]);
        return sub(between, HALF_PI).x < 0.0 && sub(add(axis, between), PI).x < 0.0;
    }
    if (HAS_ANGLES && model == EQUIRECTANGULAR) {
        vec2 height = t[1].x < 0.0 ? -t[1] : t[1], latitude = angle_of(height, root(add(mul(t[0], t[0]), mul(t[2], t[2]))));
        return sub(add(latitude, angle_between(point, t)), HALF_PI).x < 0.0;
    }
    return model == ORTHOGRAPHIC || sub(point[2], pair(near_plane)).x > 0.0;
}
