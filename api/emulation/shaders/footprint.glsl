// The footprint of a Gaussian in the picture: its box, its tiles, and the factor of its inverse covariance. Covariances are pairs.

// The power of two of a length in pixels that is to be 1, where it is beyond any picture.
int power_of(float length_) {
    int power = 0;
    if (length_ > 1e6 && is_finite(length_)) {
        frexp(length_, power);
    }
    return power;
}

// The square of the deviations at which alpha reaches the least, a little larger.
float reach_of_alpha(float opacity, float least) {
    float reach = max(0.0, 2.0 * (log(opacity) - log(least))) * 1.001 + 2e-3;
    if (push.set.cut_off == ELLIPSE) {
        float deviations = push.set.cut_off_deviations;
        reach = min(reach, deviations * deviations * 1.001 + 2e-3);
    }
    return reach;
}

// Sets the ellipse by rows, within halves of a box around the record's mean. Gives the number of tiles that it reaches.
uint set_tiles(inout Record r, vec2 a, vec2 b, vec2 c, vec2 det, float reach, vec2 halves, bool is_box) {
    vec2 mean = vec2(r.mean_x.x, r.mean_y.x), place = place_of_copy(mean, 0u);
    uvec2 tiles = push.set.tiles;
    float top = floor(place.y - halves.y - 0.5), bottom = ceil(place.y + halves.y + 0.5);
    if (!(bottom >= 0.0 && top < float(push.set.area_size.y))) {
        return 0u;
    }
    uint first_row = uint(max(top, 0.0)) / TILE, last_row = min(uint(min(bottom, 65536.0)) / TILE, tiles.y - 1u);
    r.tiles_y = first_row | last_row << 16;
    r.slope = b.x / c.x;
    r.curve = is_box ? -1.0 : reach * (det.x / c.x);
    r.half_height = halves.y;
    r.half_width = halves.x;
    r.reach = b.x / sqrt(a.x) * sqrt(reach);
    uint reached = 0u;
    for (uint copy = 0u; copy < (HAS_ANGLES ? copies() : 1u); copy++) {
        Reach ellipse = reach_of(r, copy);
        for (uint row = first_row; row <= last_row; row++) {
            uvec2 columns_ = tiles_of_row(ellipse, row, tiles.x);
            reached += columns_.y - columns_.x;
        }
    }
    return reached;
}

// The opacity compensated for the low-pass, whose determinants before and after are `area` and `det`.
float compensate(float opacity, vec2 area, vec2 det) {
    vec2 ratio = div(area, det);
    ratio = ratio.x < push.set.compensation_floor ? pair(push.set.compensation_floor) : ratio;
    return mul(root(ratio), opacity).x;
}

// The deviations of a cut-off; negative if it leaves nothing. The opacity is the one that is drawn.
float cut_deviations(float opacity, vec2 area, vec2 det) {
    float deviations = push.set.cut_off_deviations, least = push.set.alpha_floor;
    if (HAS_CUT_TILES && push.set.cut_off == TILE_RECTANGLE_COMPENSATED && least > 0.0) {
        float compensated = push.set.compensated != 0u ? opacity : compensate(opacity, area, det);
        if (!(compensated >= least)) {
            return -1.0;
        }
        deviations = min(deviations, sqrt(max(0.0, 2.0 * log(compensated / least))));
    }
    return deviations;
}

// Sets the tiles of a cut-off, from the viewport's corner.
void set_cut(inout Record r, vec2 a, vec2 b, vec2 c, float deviations, int power) {
    r.cut_radius = 0.0;
    r.cut_y = 0u;
    if (HAS_CUT_TILES) {
        vec2 radius;
        if (push.set.cut_off == TILE_SQUARE) {
            vec2 half_difference = mul(sub(a, c), 0.5);
            vec2 spread = add(mul(half_difference, half_difference), mul(b, b));
            vec2 least_spread = vec2(0.1, -1.4901161e-9);
            if (HAS_LENS) {
                least_spread = ldexp(least_spread, ivec2(-4 * power));
            }
            spread = spread.x < least_spread.x ? least_spread : spread;
            radius = vec2(mul(root(add(mul(add(a, c), 0.5), root(spread))), deviations).x);
        } else {
            radius = vec2(mul(root(a), deviations).x, mul(root(c), deviations).x);
        }
        radius = ceil(HAS_LENS ? ldexp(radius, ivec2(power)) : radius);
        r.cut_radius = radius.x;
        r.cut_y = cut_tiles(sub(r.mean_y, pair(push.set.viewport.y)).x, radius.y);
    }
}

// Sets the factor of the inverse covariance.
void set_factor(inout Record r, vec2 a, vec2 b, vec2 det, int power) {
    // The scale is sqrt(log2(e) / 2).
    vec2 width = root(a), scale = vec2(0.8493217825889587, 1.7699059995379685e-08);
    r.f0 = div(scale, width);
    r.f2 = div(mul(scale, width), root(det));
    r.f1 = -div(mul(r.f2, b), a);
    if (HAS_LENS) {
        r.f0 = ldexp(r.f0, ivec2(-power));
        r.f1 = ldexp(r.f1, ivec2(-power));
        r.f2 = ldexp(r.f2, ivec2(-power));
    }
}
