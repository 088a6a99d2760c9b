#version 460
// Reads, projects and colours a Gaussian, and makes its key of the order. The numbers are those of the extension's text, under
// "What a Draw Computes".
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "set.glsl"
#include "variant.glsl"
#include "attributes.glsl"
#include "pair.glsl"
#include "harmonics.glsl"
#include "tiles.glsl"
layout(local_size_x = 256) in;

bool is_finite(float x) {
    return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u;
}

bool are_finite(vec4 v) {
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z) && is_finite(v.w);
}

// The draw that a Gaussian of the set belongs to: the last that begins at or before it.
uint draw_of(uint index) {
    uint low = 0u, high = push.set.draw_count;
    while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        if (push.set.draws.at[middle].base <= index) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

uint index_at(Draw d, uint place) {
    if (place >= d.index_count) {
        return 0u;
    }
    // No more than 2^32 bytes: an index buffer beyond has indices that no draw of 2^24 Gaussians reaches.
    uvec2 at = advanced(d.indices, place * d.index_bytes);
    return d.index_bytes == 1u ? byte_at(at) : d.index_bytes == 2u ? half_at(at) : any_word_at(at);
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
    uint within = i - d.base, vertex = d.first + within % d.count, instance = d.first_instance + within / d.count;
    if (d.is_indexed != 0u) {
        vertex = index_at(d, vertex) + uint(d.vertex_offset);
    }
    vec4 values[8];
    for (uint which = 0u; which < 8u; which++) {
        bool is_used = which < MATRIX || (which == FACTOR ? HAS_FACTOR : HAS_MATRIX);
        bool is_three = which == POSITION || which == SCALE, is_one = which == OPACITY || which == FACTOR;
        values[which] = vec4(0.0);
        if (is_used) {
            values[which] = read_attribute(draw, which, vertex, instance, d.first_instance, is_three ? 3u : is_one ? 1u : 4u);
        }
    }
    vec3 position = values[POSITION].xyz, scale = values[SCALE].xyz;
    vec4 rotation = values[ROTATION];
    float opacity = values[OPACITY].x;
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
    float depth = t[2].x;
    if (!(depth > camera.near_plane && depth < camera.far_plane)) {
        return;
    }

    // Step 3: mean and covariance.
    bool is_orthographic = camera.model == 1;
    vec2 u = is_orthographic ? t[0] : div(t[0], t[2]), v = is_orthographic ? t[1] : div(t[1], t[2]);
    vec2 mean_x = add(add(mul(u, camera.focal_length.x), pair(camera.principal_point.x)), pair(push.set.viewport.x));
    vec2 mean_y = add(add(mul(v, camera.focal_length.y), pair(camera.principal_point.y)), pair(push.set.viewport.y));
    vec2 distance_ = is_orthographic ? pair(1.0) : t[2];
    if (is_orthographic) {
        u = pair(0.0);
        v = pair(0.0);
    } else {
        u = u.x > push.set.derived.of.limits[0].x ? push.set.derived.of.limits[0] : u;
        u = u.x < -push.set.derived.of.limits[1].x ? -push.set.derived.of.limits[1] : u;
        v = v.x > push.set.derived.of.limits[2].x ? push.set.derived.of.limits[2] : v;
        v = v.x < -push.set.derived.of.limits[3].x ? -push.set.derived.of.limits[3] : v;
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
    vec2 m[6];
    for (int r = 0; r < 2; r++) {
        vec2 slope = r == 0 ? u : v, factor = div(pair(camera.focal_length[r]), distance_), b[3];
        for (int c = 0; c < 3; c++) {
            b[c] = mul(factor, sub(pair(camera.rotation[r][c]), mul(slope, camera.rotation[2][c])));
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

    // Step 4: the low-pass, determinants and compensation.
    vec2 a0 = dot3(m[0], m[1], m[2], m[0], m[1], m[2]), b = dot3(m[0], m[1], m[2], m[3], m[4], m[5]);
    vec2 c0 = dot3(m[3], m[4], m[5], m[3], m[4], m[5]), low_pass = pair(push.set.low_pass);
    vec2 a = add(a0, low_pass), c = add(c0, low_pass);
    vec2 n0 = cross2(m[1], m[5], m[2], m[4]), n1 = cross2(m[2], m[3], m[0], m[5]), n2 = cross2(m[0], m[4], m[1], m[3]);
    vec2 area = dot3(n0, n1, n2, n0, n1, n2);
    vec2 det = add(area, add(mul(low_pass, add(a0, c0)), mul(low_pass, low_pass)));
    if (!(det.x > 0.0) || !is_finite(det.x)) {
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
        vec2 ratio = div(area, det);
        ratio = ratio.x < push.set.compensation_floor ? pair(push.set.compensation_floor) : ratio;
        opacity = mul(root(ratio), opacity).x;
        if (!(opacity >= least)) {
            return;
        }
    }

    // The ellipse in which alpha reaches the floor, a little larger, and its tiles.
    float reach = max(0.0, 2.0 * (log(opacity) - log(least))) * 1.001 + 2e-3;
    float deviations = push.set.cut_off_deviations;
    if (push.set.cut_off == ELLIPSE) {
        reach = min(reach, deviations * deviations * 1.001 + 2e-3);
    }
    float half_width = sqrt(reach * a.x) * 1.0001 + 0.01, half_height = sqrt(reach * c.x) * 1.0001 + 0.01;
    float x = mean_x.x - float(push.set.area_origin.x), y = mean_y.x - float(push.set.area_origin.y);
    float left = floor(x - half_width - 0.5), right = ceil(x + half_width + 0.5);
    float top = floor(y - half_height - 0.5), bottom = ceil(y + half_height + 0.5);
    if (!(right >= 0.0 && bottom >= 0.0 && left < float(push.set.area_size.x) && top < float(push.set.area_size.y))) {
        return;
    }
    uvec2 first_tile = uvec2(max(vec2(left, top), vec2(0.0))) / TILE;
    uvec2 last_tile = min(uvec2(min(vec2(right, bottom), vec2(65536.0))) / TILE, push.set.tiles - 1u);

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

    // Tiles of a cut-off, from the viewport's corner.
    uvec2 cut_x = uvec2(0u), cut_y = uvec2(0u);
    if (HAS_CUT_TILES) {
        vec2 from = vec2(sub(mean_x, pair(push.set.viewport.x)).x, sub(mean_y, pair(push.set.viewport.y)).x), first, end;
        if (push.set.cut_off == TILE_SQUARE) {
            vec2 half_difference = mul(sub(a, c), 0.5);
            vec2 spread = add(mul(half_difference, half_difference), mul(b, b));
            spread = spread.x < 0.1 ? vec2(0.1, -1.4901161e-9) : spread;
            vec2 radius = vec2(ceil(mul(root(add(mul(add(a, c), 0.5), root(spread))), deviations).x));
            first = floor((from - 0.5 - radius) / 16.0);
            end = floor((from - 0.5 + radius + 15.0) / 16.0);
        } else {
            vec2 radius = vec2(ceil(mul(root(a), deviations).x), ceil(mul(root(c), deviations).x));
            first = floor((from - radius) / 16.0);
            end = ceil((from + radius) / 16.0);
        }
        uvec2 firsts = uvec2(clamp(first, vec2(0.0), vec2(65535.0))), ends = uvec2(clamp(end, vec2(0.0), vec2(65535.0)));
        cut_x = uvec2(firsts.x, ends.x);
        cut_y = uvec2(firsts.y, ends.y);
    }

    // The factor of the inverse covariance; sqrt(log2(e) / 2).
    vec2 width = root(a), scale_2 = vec2(0.8493217825889587, 1.7699059995379685e-08);
    Record r;
    r.mean_x = mean_x;
    r.mean_y = mean_y;
    r.f0 = div(scale_2, width);
    r.f2 = div(mul(scale_2, width), root(det));
    r.f1 = -div(mul(r.f2, b), a);
    r.opacity = opacity;
    r.red = color.x;
    r.green = color.y;
    r.blue = color.z;
    r.tiles_x = first_tile.x | last_tile.x << 16;
    r.tiles_y = first_tile.y | last_tile.y << 16;
    r.slope = b.x / c.x;
    r.curve = reach * (det.x / c.x);
    r.half_height = half_height;
    r.half_width = half_width;
    r.reach = b.x / sqrt(a.x) * sqrt(reach);
    r.cut_x = cut_x.x | cut_x.y << 16;
    r.cut_y = cut_y.x | cut_y.y << 16;
    r.unused = 0.0;
    push.set.records.at[i] = r;

    // The number of its tiles.
    vec2 mean = vec2(mean_x.x, mean_y.x), origin = vec2(push.set.area_origin);
    float margin = margin_of(mean, origin, half_width, half_height);
    Reach ellipse = Reach(x, y, margin, r.slope, r.curve, half_height, r.reach, r.tiles_x, r.tiles_y);
    uint reached = 0u, across = push.set.tiles.x;
    for (uint row = first_tile.y; row <= last_tile.y; row++) {
        uvec2 tiles = tiles_of_row(ellipse, row, across);
        reached += tiles.y - tiles.x;
    }
    push.set.reached.at[i] = reached;

    // The key, as an unsigned number in the same order.
    float by = depth;
    if (push.set.order == RADIAL_DISTANCE) {
        by = root(dot3(e[0], e[1], e[2], e[0], e[1], e[2])).x;
    }
    uint key = floatBitsToUint(by);
    key = (key & 0x80000000u) != 0u ? ~key : key | 0x80000000u;
    push.set.keys.at[i] = push.set.order == PRIMITIVE ? 0u : key;
}
