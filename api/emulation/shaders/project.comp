#version 460
// Reads, projects and colours a Gaussian, and makes its key of the order. The numbers are those of the extension's text, under
// "What a Draw Computes".
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "set.glsl"
#include "variant.glsl"
#include "attributes.glsl"
#include "pair.glsl"
#include "draws.glsl"
#include "depths.glsl"
#include "activation.glsl"
#include "decoding.glsl"
#include "angles.glsl"
#include "cameras.glsl"
#include "lens.glsl"
#include "harmonics.glsl"
#include "tiles.glsl"
#include "footprint.glsl"
#include "surfel.glsl"
layout(local_size_x = 256) in;

// Reports whether a sigma point's place lies in the part of the picture in which it counts.
bool counts(Camera camera, vec2 u, vec2 v) {
    vec2 x = add(mul(u, camera.focal_length.x), pair(camera.principal_point.x));
    vec2 y = add(mul(v, camera.focal_length.y), pair(camera.principal_point.y));
    bool is_column = sub(x, push.set.picture[0]).x >= 0.0 && sub(x, push.set.picture[1]).x < 0.0;
    return is_column && sub(y, push.set.picture[2]).x >= 0.0 && sub(y, push.set.picture[3]).x < 0.0;
}

void main() {
    uint i = group() * 256u + gl_LocalInvocationIndex;
    if (i >= push.set.counters.at[GAUSSIANS]) {
        return;
    }
    push.set.keys.at[i] = NOT_SEEN;

    // The vertex and its attributes.
    uint draw = draw_of(i);
    Draw d = push.set.draws.at[draw];
    uvec2 member = member_of(d, i);
    uint vertex = member.x, instance = member.y;
    vec4 values[8];
    for (uint which = 0u; which < 8u; which++) {
        bool is_used = which < MATRIX || (which == FACTOR ? HAS_FACTOR : HAS_MATRIX);
        bool is_three = which == POSITION || which == SCALE, is_one = which == OPACITY || which == FACTOR;
        uint wanted = is_one ? 1u : IS_SURFEL && which == SCALE ? 2u : is_three ? 3u : 4u;
        values[which] = vec4(0.0);
        bool is_decoded = HAS_DECODINGS && which < MATRIX && decoding_of(2u * which) != NOT_DECODED;
        if (is_used && !is_decoded) {
            values[which] = read_attribute(draw, which, vertex, instance, d.first_instance, wanted);
        }
    }
    vec3 position = values[POSITION].xyz, scale = values[SCALE].xyz;
    vec4 rotation = values[ROTATION];
    float opacity = values[OPACITY].x;
    // Functions take decoded numbers before they are rounded.
    vec2 logarithms[3] = vec2[3](pair(scale.x), pair(scale.y), pair(scale.z)), logit = pair(opacity);
    if (HAS_DECODINGS) {
        vec2 numbers[3];
        uint decoding = decoding_of(POSITION_CODES);
        if (decoding != NOT_DECODED) {
            decode(draw, POSITION, POSITION_TABLE, decoding, member, 3u, numbers);
            for (int j = 0; j < 3; j++) {
                bool is_logarithm = (push.set.decodings & SIGNED_LOGARITHMS) != 0u;
                position[j] = is_logarithm ? number_of_signed_logarithm(numbers[j]) : numbers[j].x;
            }
        }
        decoding = decoding_of(SCALE_CODES);
        if (decoding != NOT_DECODED) {
            decode(draw, SCALE, SCALE_TABLE, decoding, member, 3u, logarithms);
            scale = vec3(logarithms[0].x, logarithms[1].x, logarithms[2].x);
        }
        decoding = decoding_of(ROTATION_CODES);
        if (decoding != NOT_DECODED) {
            rotation = decode_rotation(draw, decoding, member);
        }
        decoding = decoding_of(OPACITY_CODES);
        if (decoding != NOT_DECODED) {
            decode(draw, OPACITY, OPACITY_TABLE, decoding, member, 1u, numbers);
            logit = numbers[0];
            opacity = logit.x;
        }
    }
    if (HAS_LOGARITHMS) {
        for (int j = 0; j < (IS_SURFEL ? 2 : 3); j++) {
            scale[j] = scale_of_logarithm(logarithms[j]);
        }
    }
    if (HAS_LOGITS) {
        opacity = opacity_of_logit(logit);
    }
    if (HAS_FACTOR) {
        precise float product = opacity * values[FACTOR].x;
        opacity = product;
    }

    // Step 1: what is skipped.
    bool usable = are_finite(vec4(position, opacity)) && are_finite(vec4(scale, 0.0)) && are_finite(rotation);
    usable = usable && all(greaterThanEqual(scale, vec3(0.0))) && opacity >= push.set.alpha_floor;
    vec4 sizes = abs(rotation);
    float largest = max(max(sizes.x, sizes.y), max(sizes.z, sizes.w));
    usable = usable && largest > 0.0;
    if (HAS_MATRIX) {
        usable = usable && are_finite(values[MATRIX]) && are_finite(values[MATRIX + 1u]) && are_finite(values[MATRIX + 2u]);
    }
    if (!usable) {
        return;
    }

    // Step 2: from the eye, e, and in the camera's axes, t.
    Camera camera = push.set.cameras.at[min(push.view, push.set.camera_count - 1u)];
    vec2 e[3], t[3];
    for (int j = 0; j < 3; j++) {
        vec3 eye = push.set.derived.of.eye[j];
        vec2 from;
        if (HAS_MATRIX) {
            vec4 row = values[MATRIX + uint(j)];
            from = add(add(two_product(row.x, position.x), two_product(row.y, position.y)), two_product(row.z, position.z));
            from = add(add(from, pair(row.w)), pair(-eye.x));
        } else {
            from = two_sum(position[j], -eye.x);
        }
        e[j] = add(add(from, pair(-eye.y)), pair(-eye.z));
    }
    for (int r = 0; r < 3; r++) {
        vec3 row = camera.rotation[r].xyz;
        t[r] = add(add(mul(e[0], row.x), mul(e[1], row.y)), mul(e[2], row.z));
    }
    bool is_orthographic = camera.model == ORTHOGRAPHIC, has_angles = HAS_ANGLES && camera.model >= FISHEYE;
    // What is straight behind a fisheye has no pixel.
    if (has_angles && camera.model == FISHEYE && t[0].x == 0.0 && t[1].x == 0.0 && !(t[2].x > 0.0)) {
        return;
    }
    vec2 depth_pair = has_angles ? root(dot3(t[0], t[1], t[2], t[0], t[1], t[2])) : t[2];
    float depth = depth_pair.x;
    if (!(depth > camera.near_plane && depth < camera.far_plane)) {
        return;
    }

    // Step 3: mean and covariance.
    vec2 u, v, distance_ = is_orthographic || has_angles ? pair(1.0) : t[2];
    pixel_of(camera.model, t, u, v);
    Lens lens;
    vec2 shown_u = u, shown_v = v, bent[4];
    bool has_lens = false;
    if (HAS_LENS) {
        lens = lens_of_view();
        has_lens = lens.model != NO_LENS;
        if (has_lens) {
            if (!is_before_fold(lens, u, v)) {
                return;
            }
            distort(lens, u, v, shown_u, shown_v, bent);
        }
    }
    vec2 mean_x = add(add(mul(shown_u, camera.focal_length.x), pair(camera.principal_point.x)), pair(push.set.viewport.x));
    vec2 mean_y = add(add(mul(shown_v, camera.focal_length.y), pair(camera.principal_point.y)), pair(push.set.viewport.y));
    if (is_orthographic) {
        u = pair(0.0);
        v = pair(0.0);
    } else {
        u = u.x > push.set.derived.of.limits[0].x ? push.set.derived.of.limits[0] : u;
        u = u.x < -push.set.derived.of.limits[1].x ? -push.set.derived.of.limits[1] : u;
        v = v.x > push.set.derived.of.limits[2].x ? push.set.derived.of.limits[2] : v;
        v = v.x < -push.set.derived.of.limits[3].x ? -push.set.derived.of.limits[3] : v;
    }
    vec2 derivative[6];
    if (has_angles) {
        derivative_of(camera.model, t, derivative);
    }
    // R(q) = 1 + (2 / |q|^2) (...): without a root.
    vec2 q[4];
    for (int j = 0; j < 4; j++) {
        q[j] = div(pair(rotation[j]), pair(largest));
    }
    vec2 norm = add(add(mul(q[0], q[0]), mul(q[1], q[1])), add(mul(q[2], q[2]), mul(q[3], q[3])));
    vec2 k = div(pair(2.0), norm), one = pair(1.0);
    vec2 xx = mul(k, mul(q[1], q[1])), yy = mul(k, mul(q[2], q[2])), zz = mul(k, mul(q[3], q[3]));
    vec2 xy = mul(k, mul(q[1], q[2])), xz = mul(k, mul(q[1], q[3])), yz = mul(k, mul(q[2], q[3]));
    vec2 wx = mul(k, mul(q[0], q[1])), wy = mul(k, mul(q[0], q[2])), wz = mul(k, mul(q[0], q[3]));
    vec2 turn[9] = vec2[9](sub(one, add(yy, zz)), sub(xy, wz), add(xz, wy), add(xy, wz), sub(one, add(xx, zz)), sub(yz, wx),
                           sub(xz, wy), add(yz, wx), sub(one, add(xx, yy)));
    // Rows of the ideal lens's Jacobian times the rotation, for a focal length of 1.
    vec2 ideal[6];
    if (HAS_LENS && has_lens) {
        for (int r = 0; r < 2; r++) {
            vec2 slope = r == 0 ? u : v;
            for (int c = 0; c < 3; c++) {
                if (has_angles) {
                    vec2 along = add(mul(derivative[r * 3], camera.rotation[0][c]), mul(derivative[r * 3 + 1], camera.rotation[1][c]));
                    ideal[r * 3 + c] = add(along, mul(derivative[r * 3 + 2], camera.rotation[2][c]));
                } else {
                    ideal[r * 3 + c] = div(sub(pair(camera.rotation[r][c]), mul(slope, camera.rotation[2][c])), distance_);
                }
            }
        }
    }
    vec2 m[6];
    for (int r = 0; r < 2; r++) {
        vec2 slope = r == 0 ? u : v, factor = div(pair(camera.focal_length[r]), distance_), b[3];
        for (int c = 0; c < 3; c++) {
            if (HAS_LENS && has_lens) {
                b[c] = mul(add(mul(bent[r * 2], ideal[c]), mul(bent[r * 2 + 1], ideal[3 + c])), camera.focal_length[r]);
            } else if (has_angles) {
                vec2 along = add(mul(derivative[r * 3], camera.rotation[0][c]), mul(derivative[r * 3 + 1], camera.rotation[1][c]));
                b[c] = mul(add(along, mul(derivative[r * 3 + 2], camera.rotation[2][c])), camera.focal_length[r]);
            } else {
                b[c] = mul(factor, sub(pair(camera.rotation[r][c]), mul(slope, camera.rotation[2][c])));
            }
        }
        if (HAS_MATRIX) {
            vec2 w[3];
            for (int c = 0; c < 3; c++) {
                w[c] = add(add(mul(b[0], values[MATRIX][c]), mul(b[1], values[MATRIX + 1u][c])), mul(b[2], values[MATRIX + 2u][c]));
            }
            b = w;
        }
        for (int c = 0; c < 3; c++) {
            m[r * 3 + c] = mul(dot3(b[0], b[1], b[2], turn[c], turn[3 + c], turn[6 + c]), scale[c]);
        }
    }

    // A lens moves what is far beside its axis far away: lengths in the picture are then in units of 2^power pixels, so that their fourth
    // powers are finite.
    int power = 0;
    if (HAS_LENS && has_lens) {
        float largest_m = 0.0;
        for (int j = 0; j < 6; j++) {
            largest_m = max(largest_m, abs(m[j].x));
        }
        power = power_of(largest_m);
        for (int j = 0; j < 6; j++) {
            m[j] = ldexp(m[j], ivec2(-power));
        }
    }
    vec2 a0 = dot3(m[0], m[1], m[2], m[0], m[1], m[2]), b = dot3(m[0], m[1], m[2], m[3], m[4], m[5]);
    vec2 c0 = dot3(m[3], m[4], m[5], m[3], m[4], m[5]);
    vec2 n0 = cross2(m[1], m[5], m[2], m[4]), n1 = cross2(m[2], m[3], m[0], m[5]), n2 = cross2(m[0], m[4], m[1], m[3]);
    vec2 area = dot3(n0, n1, n2, n0, n1, n2);
    if (IS_UNSCENTED) {
        // Columns of the axes' standard deviations, in the camera's axes.
        vec2 axes[9];
        for (int row = 0; row < 3; row++) {
            vec2 w[3];
            for (int c = 0; c < 3; c++) {
                w[c] = pair(camera.rotation[row][c]);
            }
            if (HAS_MATRIX) {
                vec3 turned = camera.rotation[row].xyz;
                for (int c = 0; c < 3; c++) {
                    vec2 first = add(two_product(turned.x, values[MATRIX][c]), two_product(turned.y, values[MATRIX + 1u][c]));
                    w[c] = add(first, two_product(turned.z, values[MATRIX + 2u][c]));
                }
            }
            for (int c = 0; c < 3; c++) {
                axes[row * 3 + c] = mul(dot3(w[0], w[1], w[2], turn[c], turn[3 + c], turn[6 + c]), scale[c]);
            }
        }
        // Pixels of the sigma points from that of the middle, which is the first.
        vec2 us[7], vs[7], middle_u = shown_u, middle_v = shown_v, sum_u = vec2(0.0), sum_v = vec2(0.0);
        bool all_are_seen = true;
        uint counted = counts(camera, middle_u, middle_v) ? 1u : 0u;
        us[0] = vec2(0.0);
        vs[0] = vec2(0.0);
        for (int point = 1; point < 7; point++) {
            int axis = (point - 1) / 2;
            vec2 place[3], own_u, own_v;
            for (int row = 0; row < 3; row++) {
                vec2 away = mul(push.set.sigma_distance, axes[row * 3 + axis]);
                place[row] = add(t[row], (point & 1) == 1 ? away : -away);
            }
            bool is_point_seen = is_seen(camera.model, camera.near_plane, t, place);
            pixel_of(camera.model, place, own_u, own_v);
            if (HAS_LENS && has_lens) {
                is_point_seen = is_point_seen && is_before_fold(lens, own_u, own_v);
                if (is_point_seen) {
                    vec2 ideal_u = own_u, ideal_v = own_v, unused[4];
                    distort(lens, ideal_u, ideal_v, own_u, own_v, unused);
                }
            }
            all_are_seen = all_are_seen && is_point_seen;
            own_u = sub(own_u, middle_u);
            if (HAS_ANGLES && camera.model == EQUIRECTANGULAR) {
                own_u = own_u.x > HALF_PI.x * 2.0 ? sub(own_u, 2.0 * PI) : own_u.x < -HALF_PI.x * 2.0 ? add(own_u, 2.0 * PI) : own_u;
            }
            us[point] = own_u;
            vs[point] = sub(own_v, middle_v);
            if (is_point_seen && push.set.must_count != 0u && counts(camera, add(us[point], middle_u), own_v)) {
                counted++;
            }
            sum_u = add(sum_u, us[point]);
            sum_v = add(sum_v, vs[point]);
        }
        if (counted < push.set.must_count) {
            return;
        }
        if (all_are_seen) {
            // In pixels, from the mean.
            vec2 center = push.set.sigma_center, other_ = push.set.sigma_other;
            vec2 mean_u = mul(sum_u, other_), mean_v = mul(sum_v, other_);
            a0 = vec2(0.0);
            b = vec2(0.0);
            c0 = vec2(0.0);
            area = vec2(0.0);
            float largest_m = 0.0;
            for (int point = 0; point < 7; point++) {
                us[point] = mul(sub(us[point], mean_u), camera.focal_length.x);
                vs[point] = mul(sub(vs[point], mean_v), camera.focal_length.y);
                largest_m = max(largest_m, max(abs(us[point].x), abs(vs[point].x)));
            }
            power = HAS_LENS && has_lens ? power_of(largest_m) : 0;
            for (int point = 0; point < 7; point++) {
                vec2 weight = point == 0 ? center : other_;
                if (HAS_LENS && has_lens) {
                    us[point] = ldexp(us[point], ivec2(-power));
                    vs[point] = ldexp(vs[point], ivec2(-power));
                }
                a0 = add(a0, mul(weight, mul(us[point], us[point])));
                b = add(b, mul(weight, mul(us[point], vs[point])));
                c0 = add(c0, mul(weight, mul(vs[point], vs[point])));
                for (int other = 0; other < point; other++) {
                    vec2 product = cross2(us[point], vs[other], vs[point], us[other]);
                    area = add(area, mul(mul(weight, other == 0 ? center : other_), mul(product, product)));
                }
            }
            mean_x = add(mean_x, mul(mean_u, camera.focal_length.x));
            mean_y = add(mean_y, mul(mean_v, camera.focal_length.y));
        }
    }

    // Step 4: the low-pass, determinants and compensation.
    vec2 low_pass = pair(push.set.low_pass);
    if (HAS_LENS && has_lens) {
        low_pass = ldexp(low_pass, ivec2(-2 * power));
        if (!is_finite(mean_x.x) || !is_finite(mean_y.x)) {
            return;
        }
    }
    vec2 a = add(a0, low_pass), c = add(c0, low_pass);
    vec2 det = add(area, add(mul(low_pass, add(a0, c0)), mul(low_pass, low_pass)));
    // With a negative weight in the middle the sum may be no covariance.
    if (IS_UNSCENTED && !(a.x >= 0.0 && c.x >= 0.0)) {
        return;
    }
    if (!IS_SURFEL && (!(det.x > 0.0) || !is_finite(det.x))) {
        return;
    }
    // The inverse of a matrix but for its determinant, which also says whether it is singular.
    vec2 adjoint[9];
    vec2 volume = pair(1.0);
    if (HAS_MATRIX) {
        vec3 r0 = values[MATRIX].xyz, r1 = values[MATRIX + 1u].xyz, r2 = values[MATRIX + 2u].xyz;
        // Rows of length about 1, so that nothing overflows.
        vec3 size = vec3(max(max(abs(r0.x), abs(r0.y)), abs(r0.z)), max(max(abs(r1.x), abs(r1.y)), abs(r1.z)),
                         max(max(abs(r2.x), abs(r2.y)), abs(r2.z)));
        if (!(min(min(size.x, size.y), size.z) > 0.0)) {
            return;
        }
        ivec3 power;
        frexp(size, power);
        r0 = ldexp(r0, ivec3(-power.x));
        r1 = ldexp(r1, ivec3(-power.y));
        r2 = ldexp(r2, ivec3(-power.z));
        for (int j = 0; j < 3; j++) {
            int p = (j + 1) % 3, s = (j + 2) % 3;
            adjoint[j * 3] = sub(two_product(r1[p], r2[s]), two_product(r1[s], r2[p]));
            adjoint[j * 3 + 1] = sub(two_product(r2[p], r0[s]), two_product(r2[s], r0[p]));
            adjoint[j * 3 + 2] = sub(two_product(r0[p], r1[s]), two_product(r0[s], r1[p]));
        }
        volume = add(add(mul(adjoint[0], r0.x), mul(adjoint[3], r0.y)), mul(adjoint[6], r0.z));
        if (!(abs(volume.x) > 9.094947e-13 * length(r0) * length(r1) * length(r2))) {
            return;
        }
        // The inverse takes what the rows were divided by: e is divided likewise, up to a common power of two.
        int highest = max(max(-power.x, -power.y), -power.z);
        for (int j = 0; j < 9; j++) {
            adjoint[j] = ldexp(adjoint[j], ivec2(-power[j % 3] - highest));
        }
    }
    float least = max(push.set.alpha_floor, 1.2e-38);
    if (push.set.compensated != 0u) {
        opacity = compensate(opacity, area, det);
        if (!(opacity >= least)) {
            return;
        }
    }
    float deviations = cut_deviations(opacity, area, det);
    if (deviations < 0.0) {
        return;
    }

    // The ellipse in which alpha reaches the floor, a little larger, and its tiles.
    float reach = reach_of_alpha(opacity, least);
    float half_width = sqrt(reach * a.x) * 1.0001, half_height = sqrt(reach * c.x) * 1.0001;
    if (HAS_LENS && has_lens) {
        half_width = ldexp(half_width, power);
        half_height = ldexp(half_height, power);
    }
    half_width += 0.01;
    half_height += 0.01;
    Surfel surfel;
    if (IS_SURFEL) {
        // The axes, in the camera's axes.
        vec2 axes[6];
        for (int row = 0; row < 3; row++) {
            vec3 w = camera.rotation[row].xyz;
            for (int axis = 0; axis < 2; axis++) {
                vec2 along = add(add(mul(turn[axis], w.x), mul(turn[3 + axis], w.y)), mul(turn[6 + axis], w.z));
                axes[row * 2 + axis] = mul(along, scale[axis]);
            }
        }
        vec2 a0 = axes[0], a1 = axes[2], a2 = axes[4], b0 = axes[1], b1 = axes[3], b2 = axes[5];
        vec2 n0 = cross2(a1, b2, a2, b1), n1 = cross2(a2, b0, a0, b2), n2 = cross2(a0, b1, a1, b0);
        vec2 w = n2, slope_x = div(t[0], t[2]), slope_y = div(t[1], t[2]);
        surfel.ux = b1;
        surfel.uy = -b0;
        surfel.vx = -a1;
        surfel.vy = a0;
        surfel.wx = vec2(0.0);
        surfel.wy = vec2(0.0);
        if (!is_orthographic) {
            w = add(add(mul(n0, slope_x), mul(n1, slope_y)), n2);
            surfel.ux = cross2(b1, t[2], b2, t[1]);
            surfel.uy = cross2(b2, t[0], b0, t[2]);
            surfel.vx = cross2(t[1], a2, t[2], a1);
            surfel.vy = cross2(t[2], a0, t[0], a2);
            surfel.wx = n0;
            surfel.wy = n1;
        }
        vec2 by_x = mul(w, camera.focal_length.x), by_y = mul(w, camera.focal_length.y);
        surfel.ux = div(surfel.ux, by_x);
        surfel.uy = div(surfel.uy, by_y);
        surfel.vx = div(surfel.vx, by_x);
        surfel.vy = div(surfel.vy, by_y);
        surfel.wx = div(surfel.wx, by_x);
        surfel.wy = div(surfel.wy, by_y);
        surfel.limit = is_orthographic ? 3.4e38 : div(t[2], pair(camera.near_plane)).x;
        // Seen from its edge there is the filter alone.
        if (w.x == 0.0 || !is_finite(surfel.ux.x + surfel.uy.x + surfel.vx.x + surfel.vy.x + surfel.wx.x + surfel.wy.x)) {
            surfel = Surfel(vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0), 0.0);
        }
        // The box of the disc, from the mean, and that of the filter. A disc that is not wholly in front may be anywhere.
        vec2 sides = vec2(0.0), middles = vec2(0.0);
        float nearest = 1.0;
        vec2 across = vec2(sub(a0, mul(slope_x, a2)).x, sub(b0, mul(slope_x, b2)).x);
        vec2 down = vec2(sub(a1, mul(slope_y, a2)).x, sub(b1, mul(slope_y, b2)).x);
        if (is_orthographic) {
            across = vec2(a0.x, b0.x);
            down = vec2(a1.x, b1.x);
        } else {
            vec2 forth = vec2(a2.x, b2.x) / t[2].x;
            across /= t[2].x;
            down /= t[2].x;
            nearest = 1.0 - reach * dot(forth, forth);
            middles = reach * vec2(dot(across, forth), dot(down, forth)) / nearest;
        }
        sides = sqrt(middles * middles + reach * vec2(dot(across, across), dot(down, down)) / nearest);
        vec2 halves = camera.focal_length * (abs(middles) + sides) * 1.001 + 0.01;
        if (!(nearest > 1e-3) || !is_finite(halves.x) || !is_finite(halves.y)) {
            halves = vec2(1e6);
        }
        float filtered = sqrt(reach * push.set.low_pass) * 1.001 + 0.01;
        if (HAS_CUT_TILES) {
            // The outline's rectangle at one standard deviation, about whose middle the filter is.
            vec2 shifts[2], halves_of_one[2];
            for (int j = 0; j < 2; j++) {
                vec2 slope = j == 0 ? slope_x : slope_y;
                vec2 along_a = mul(j == 0 ? a0 : a1, camera.focal_length[j]), along_b = mul(j == 0 ? b0 : b1, camera.focal_length[j]);
                if (is_orthographic) {
                    shifts[j] = vec2(0.0);
                    halves_of_one[j] = root(add(mul(along_a, along_a), mul(along_b, along_b)));
                } else {
                    vec2 divisor = sub(add(mul(a2, a2), mul(b2, b2)), mul(t[2], t[2]));
                    if (divisor.x == 0.0) {
                        return;
                    }
                    along_a = sub(along_a, mul(mul(a2, slope), camera.focal_length[j]));
                    along_b = sub(along_b, mul(mul(b2, slope), camera.focal_length[j]));
                    shifts[j] = div(add(mul(along_a, a2), mul(along_b, b2)), divisor);
                    vec2 across_ = div(add(mul(along_a, along_a), mul(along_b, along_b)), divisor);
                    vec2 square = sub(mul(shifts[j], shifts[j]), across_);
                    halves_of_one[j] = square.x < 1e-4 ? vec2(0.01, 2.2351741e-10) : root(square);
                }
            }
            vec2 radius = ceil(vec2(mul(halves_of_one[0], deviations).x, mul(halves_of_one[1], deviations).x));
            vec2 middle_x = add(mean_x, shifts[0]), middle_y = add(mean_y, shifts[1]);
            if (!is_finite(middle_x.x) || !is_finite(middle_y.x) || isnan(radius.x) || isnan(radius.y)) {
                return;
            }
            Rectangle rectangle = Rectangle(shifts[0], shifts[1], 0u, 0u);
            rectangle.columns = cut_tiles(sub(middle_x, pair(push.set.viewport.x)).x, radius.x);
            rectangle.rows = cut_tiles(sub(middle_y, pair(push.set.viewport.y)).x, radius.y);
            push.set.rectangles.at[i] = rectangle;
            halves = max(halves, abs(vec2(shifts[0].x, shifts[1].x)) + filtered);
        }
        half_width = max(halves.x, filtered);
        half_height = max(halves.y, filtered);
    }
    Record r;
    r.mean_x = mean_x;
    r.mean_y = mean_y;
    // In units of a power of two there is but a box.
    uint reached = set_tiles(r, a, b, c, det, reach, vec2(half_width, half_height), HAS_LENS && power != 0);
    if (reached == 0u) {
        return;
    }

    // Step 5: the colour.
    vec3 direction = vec3(e[0].x, e[1].x, e[2].x);
    if (HAS_MATRIX) {
        for (int j = 0; j < 3; j++) {
            vec2 sum = dot3(adjoint[j * 3], adjoint[j * 3 + 1], adjoint[j * 3 + 2], e[0], e[1], e[2]);
            direction[j] = volume.x < 0.0 ? -sum.x : sum.x;
        }
    }
    float extent = max(max(abs(direction.x), abs(direction.y)), abs(direction.z));
    if (extent > 0.0) {
        direction /= extent;
        direction *= inversesqrt(dot(direction, direction));
    }
    float functions[25];
    harmonics(direction, functions);
    uint used = (push.set.degree + 1u) * (push.set.degree + 1u), step_ = push.set.harmonics_step;
    Place first = place_of(draw, push.set.attributes[HARMONICS], vertex, instance, d.first_instance);
    vec3 color = vec3(0.5);
    for (uint f = 0u; f < (DEGREE + 1u) * (DEGREE + 1u); f++) {
        if (f >= used) {
            break;
        }
        vec3 coefficient;
        if (HARMONICS_IN_BUFFER) {
            uint high, low, place;
            umulExtended(f, d.harmonics_coefficient_stride, high, low);
            bool is_within = high == 0u
                && lies_within(vertex, d.harmonics_stride, low, format_bytes(d.harmonics_format), d.harmonics_bytes, place);
            coefficient = element(d.harmonics, place, is_within, d.harmonics_format, 3u).xyz;
        } else if (HAS_DECODINGS && f == 0u && decoding_of(COLOR_CODES) != NOT_DECODED) {
            vec2 numbers[3];
            decode(draw, HARMONICS, COLOR_TABLE, decoding_of(COLOR_CODES), member, 3u, numbers);
            for (int j = 0; j < 3; j++) {
                bool is_base = (push.set.decodings & BASE_COLORS) != 0u;
                coefficient[j] = is_base ? coefficient_of_color(numbers[j]).x : numbers[j].x;
            }
        } else if (HAS_DECODINGS && f > 0u && decoding_of(HARMONICS_CODES) != NOT_DECODED) {
            coefficient = decode_harmonics(draw, vertex, f);
        } else if (ARE_HARMONICS_EVEN) {
            bool is_within = first.is_within && first.bytes - first.offset >= f * step_ + 12u;
            coefficient = floats(first.address, first.offset + f * step_, is_within, 3u).xyz;
        } else {
            coefficient = read_attribute(draw, HARMONICS + f, vertex, instance, d.first_instance, 3u).xyz;
        }
        usable = usable && are_finite(vec4(coefficient, 0.0));
        color += functions[f] * coefficient;
    }
    if (!usable) {
        return;
    }
    color = clamp(color, vec3(0.0), vec3(3.4028235e38));

    set_cut(r, a, b, c, deviations, HAS_LENS ? power : 0);
    set_factor(r, a, b, det, HAS_LENS ? power : 0);
    r.opacity = opacity;
    r.red = color.x;
    r.green = color.y;
    r.blue = color.z;
    r.unused0 = 0.0;
    r.unused1 = 0.0;
    if (IS_SURFEL) {
        set_surfel(r, surfel);
    }
    push.set.records.at[i] = r;
    push.set.reached.at[i] = reached;
    if (HAS_DEPTHS) {
        push.set.depths.at[i] = vec2(held_depth(camera, depth), depth);
    }
    if (IS_RESOLVED) {
        push.set.names.at[i] = uvec2(vertex, instance);
    }

    float by = depth;
    if (push.set.order == RADIAL_DISTANCE) {
        by = root(dot3(e[0], e[1], e[2], e[0], e[1], e[2])).x;
    }
    push.set.keys.at[i] = key_of(by);
}
