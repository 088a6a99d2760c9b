#version 460
// Accumulates the Gaussians of a tile front to back: a workgroup is a tile, an invocation four pixels below one another. A pixel without
// a contribution gets a negative alpha, unless its tile has none at all.
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_vote : require
#include "head.glsl"
#include "set.glsl"
#include "pair.glsl"
#include "tiles.glsl"
#include "surfel.glsl"
layout(local_size_x = 16, local_size_y = 4) in;
// A cut-off by tiles of the viewport.
layout(constant_id = 0) const bool HAS_CUT_TILES = false;
// The camera may be a panorama.
layout(constant_id = 1) const bool HAS_ANGLES = false;
layout(constant_id = 2) const bool IS_SURFEL = false;
// The median depth is kept, and depths are compared with those that samples stored before: a layer of workgroups for each sample.
layout(constant_id = 3) const bool HAS_TESTS = false;
// A resolve shader reads depths or Gaussians.
layout(constant_id = 4) const bool IS_RESOLVED = false;

const uint INVOCATIONS = 64u;
// Gaussians that are looked at together.
const uint BATCH = 128u;
const uint ROWS = 4u;

// Of the Gaussians of a batch: what gives the exponent at a pixel; its lowest value that reaches the floor; opacity; colour; tiles of the
// cut-off; index.
shared vec4 lines[BATCH];
// Of a surfel: u and v at the tile's middle times w, w there; their growth; limit; the mean's distance.
shared vec4 planes[IS_SURFEL ? 2u * BATCH : 1u];
shared vec3 scalars[BATCH];
shared vec3 colors[BATCH];
shared uvec2 cuts[HAS_CUT_TILES ? BATCH : 1u];
// In a panorama, the places in x at which the copy counts.
shared vec2 counting[HAS_ANGLES ? BATCH : 1u];
shared uint members[BATCH];
shared vec2 depths[HAS_TESTS || IS_RESOLVED ? BATCH : 1u];
// Where the pairs did not fit: Gaussians that reach the tile, and, of those that are looked at, a bit for each that does.
shared uint waiting[BATCH + INVOCATIONS];
shared uint reaching[INVOCATIONS / 32u];
shared uint unfinished, steep;

// Of the invocation's pixels: what has accumulated in batches before and in this one, what is left, and whether a pixel goes on and
// has had a contribution. Sums of batches are summed, so that ten thousand layers are as exact as a hundred.
vec3 total[ROWS], sum[ROWS];
vec4 transmittance;
bvec4 goes_on, is_reached;
float center_x;
uint cut_column;
uvec4 cut_rows;
// Of the set.
float floor_, ceiling, end;
// Of the invocation's samples: what they stored, whether their stencil tests passed, whether anything reached them, and the median depth.
vec4 stored, median;
bvec4 has_passed_stencil, is_touched;
// Of the invocation's pixels, for resolve shaders: the first Gaussian and the median's, the first one's depths, and the sums of weights
// and of weighted differences from those depths, of batches before and of this one.
uvec4 nearest, median_of;
vec4 near_depth, near_distance;
vec4 total_weight, total_depth, total_distance, sum_weight, sum_depth, sum_distance;

// Reports how depths compare with those that are stored.
bvec4 compare(float depth) {
    uint op = push.set.depth_compare;
    uvec4 is_less = uvec4(lessThan(vec4(depth), stored)), is_greater = uvec4(greaterThan(vec4(depth), stored));
    uvec4 is_equal = uvec4(equal(vec4(depth), stored));
    return bvec4((is_less & (op & 1u)) | (is_equal & (op >> 1 & 1u)) | (is_greater & (op >> 2 & 1u)));
}

// What a sample that is reached, or not, without a contribution has in place of alpha.
float outcome(uint j) {
    return !HAS_TESTS || !is_touched[j] ? NOT_REACHED : has_passed_stencil[j] ? REACHED : REACHED_IN_VAIN;
}

// Accumulates the Gaussian of a place in the batch, with the exponents and alphas that it has at the pixels.
void accumulate(uint k, vec4 exponent, vec4 alpha) {
    vec3 scalar = scalars[k], color = colors[k];
    alpha = min(vec4(ceiling), alpha);
    bvec4 is_in = bvec4(uvec4(goes_on) & uvec4(greaterThanEqual(exponent, vec4(scalar.y))) & uvec4(greaterThanEqual(alpha, vec4(floor_))));
    if (HAS_CUT_TILES) {
        uint x = cuts[k].x, y = cuts[k].y;
        bool is_column = cut_column >= (x & 0xffffu) && cut_column < x >> 16;
        bvec4 is_row = bvec4(uvec4(greaterThanEqual(cut_rows, uvec4(y & 0xffffu))) & uvec4(lessThan(cut_rows, uvec4(y >> 16))));
        is_in = bvec4(uvec4(is_in) & uvec4(is_row) & uint(is_column));
    }
    if (HAS_ANGLES) {
        is_in = bvec4(uvec4(is_in) & uint(center_x >= counting[k].x && center_x < counting[k].y));
    }
    if (HAS_TESTS) {
        is_touched = bvec4(uvec4(is_touched) | uvec4(is_in));
        is_in = bvec4(uvec4(is_in) & uvec4(compare(depths[k].x)) & uvec4(has_passed_stencil));
        goes_on = bvec4(uvec4(goes_on) & (uvec4(has_passed_stencil) | uvec4(not(is_touched))));
    }
    precise vec4 next = transmittance * (1.0 - alpha);
    bvec4 ends = bvec4(uvec4(is_in) & uvec4(lessThan(next, vec4(end))));
    is_in = bvec4(uvec4(is_in) & uvec4(not(ends)));
    goes_on = bvec4(uvec4(goes_on) & uvec4(not(ends)));
    if (IS_RESOLVED) {
        uvec4 member = uvec4(HAS_ANGLES ? members[k] & MEMBER : members[k]);
        bvec4 is_first = bvec4(uvec4(is_in) & uvec4(not(is_reached)));
        nearest = mix(nearest, member, is_first);
        near_depth = mix(near_depth, vec4(depths[k].x), is_first);
        near_distance = mix(near_distance, vec4(depths[k].y), is_first);
        median_of = mix(median_of, member, bvec4(uvec4(is_in) & uvec4(greaterThanEqual(transmittance, vec4(0.5)))));
    }
    is_reached = bvec4(uvec4(is_reached) | uvec4(is_in));
    if (HAS_TESTS) {
        median = mix(median, vec4(depths[k].x), bvec4(uvec4(is_in) & uvec4(greaterThanEqual(transmittance, vec4(0.5)))));
    }
    vec4 weight = mix(vec4(0.0), transmittance * alpha, is_in);
    if (IS_RESOLVED) {
        sum_weight += weight;
        sum_depth += weight * (depths[k].x - near_depth);
        sum_distance += weight * (depths[k].y - near_distance);
    }
    transmittance = mix(transmittance, next, is_in);
    for (uint j = 0u; j < ROWS; j++) {
        sum[j] += weight[j] * color;
    }
}

// The Gaussian of a member of the batch, with the mean of its copy.
Record record_of(uint member) {
    Record r = push.set.records.at[HAS_ANGLES ? member & MEMBER : member];
    if (HAS_ANGLES) {
        r.mean_x = add(r.mean_x, mul(push.set.derived.of.period, periods(member >> COPY_SHIFT)));
    }
    return r;
}

// The exponent of alpha, in units of log2, where a ray meets a surfel's plane at u / w and v / w, and as far from its mean.
vec4 surfel_exponent(vec4 u, vec4 v, vec4 w, float limit, vec4 square) {
    float low_pass = push.set.low_pass;
    bvec4 is_met = bvec4(uvec4(greaterThan(w, vec4(0.0))) & uvec4(lessThan(w, vec4(limit))));
    vec4 inverse = 1.0 / w, disc = (u * inverse) * (u * inverse) + (v * inverse) * (v * inverse);
    vec4 filtered = low_pass > 0.0 ? square / low_pass : vec4(3.4e38);
    return -0.7213475204 * min(mix(vec4(3.4e38), disc, is_met), filtered);
}

// Puts a Gaussian into the batch.
void admit(uint slot, uint member, vec2 middle, float least, float ellipse) {
    Record r = record_of(member);
    vec2 x = add(two_sum(middle.x, -r.mean_x.x), pair(-r.mean_x.y)), y = add(two_sum(middle.y, -r.mean_y.x), pair(-r.mean_y.y));
    float lowest = max(least - log2(r.opacity) - 0.1, -ellipse);
    bool is_steep = max(abs(r.f0.x), max(abs(r.f1.x), abs(r.f2.x))) > 3.0;
    if (IS_SURFEL) {
        Surfel s = surfel_of(r);
        vec2 w = add(pair(1.0), add(mul(s.wx, x), mul(s.wy, y)));
        lines[slot] = vec4(add(mul(s.ux, x), mul(s.uy, y)).x, s.ux.x, s.uy.x, add(mul(s.vx, x), mul(s.vy, y)).x);
        planes[2u * slot] = vec4(s.vx.x, s.vy.x, w.x, s.wx.x);
        vec2 from_x = x, from_y = y;
        if (HAS_CUT_TILES) {
            Rectangle rectangle = push.set.rectangles.at[member];
            from_x = sub(x, rectangle.shift_x);
            from_y = sub(y, rectangle.shift_y);
            cuts[slot] = uvec2(rectangle.columns, rectangle.rows);
        }
        planes[2u * slot + 1u] = vec4(s.wy.x, s.limit, from_x.x, from_y.x);
        bool turns = 32.0 * (abs(s.wx.x) + abs(s.wy.x)) > w.x;
        is_steep = turns || max(abs(s.ux.x) + abs(s.uy.x), abs(s.vx.x) + abs(s.vy.x)) > 2.0 * w.x;
        is_steep = (is_steep && s.limit > 0.0) || (push.set.low_pass > 0.0 && push.set.low_pass < 0.1);
        scalars[slot] = vec3(0.0, lowest, r.opacity);
    } else {
        lines[slot] = vec4(mul(r.f0, x).x, add(mul(r.f1, x), mul(r.f2, y)).x, r.f0.x, r.f1.x);
        scalars[slot] = vec3(r.f2.x, lowest, r.opacity);
    }
    colors[slot] = vec3(r.red, r.green, r.blue);
    members[slot] = member;
    if (HAS_TESTS || IS_RESOLVED) {
        depths[slot] = push.set.depths.at[HAS_ANGLES ? member & MEMBER : member];
    }
    if (HAS_CUT_TILES && !IS_SURFEL) {
        cuts[slot] = uvec2(cut_tiles(sub(r.mean_x, pair(push.set.viewport.x)).x, r.cut_radius), r.cut_y);
    }
    if (HAS_ANGLES) {
        float period = push.set.derived.of.period.x;
        counting[slot] = r.mean_x.x + (period == 0.0 ? vec2(-3.4e38, 3.4e38) : vec2(-0.5, 0.5) * period);
    }
    // Steep exponents and large opacities need pairs at every pixel.
    if (is_steep || r.opacity > 16.0) {
        atomicOr(steep, 1u);
    }
}

// Looks at a Gaussian, of as many as there are invocations, and has it wait if it reaches the tile. Returns the number of those that do,
// which follow the ones that were found before in their order.
uint gather(uint candidate, uint end_, uint found, uvec2 tile, uint copies_) {
    uint l = gl_LocalInvocationIndex, member = 0u;
    if (l < INVOCATIONS / 32u) {
        reaching[l] = 0u;
    }
    barrier();
    // Nothing writes them, but lavapipe 22.3 confuses what it keeps of loads before a loop: they are loaded anew.
    memoryBarrierBuffer();
    bool reaches = false;
    if (candidate < end_) {
        uint copy = candidate % copies_, index = push.set.values.at[candidate / copies_];
        Reach reach = reach_of(push.set.records.at[index], copy);
        uvec2 row = tiles_of_row(reach, tile.y, push.set.tiles.x);
        bool is_row = tile.y >= (reach.tiles_y & 0xffffu) && tile.y <= reach.tiles_y >> 16;
        reaches = is_row && tile.x >= row.x && tile.x < row.y;
        member = index | copy << COPY_SHIFT;
    }
    if (reaches) {
        atomicOr(reaching[l >> 5], 1u << (l & 31u));
    }
    barrier();
    uint before = found, all = 0u;
    for (uint k = 0u; k < INVOCATIONS / 32u; k++) {
        uint own = bitCount(reaching[k]);
        before += k < l >> 5 ? own : 0u;
        all += own;
    }
    before += bitCount(reaching[l >> 5] & ((1u << (l & 31u)) - 1u));
    if (reaches) {
        waiting[before] = member;
    }
    barrier();
    return all;
}

void main() {
    uint l = gl_LocalInvocationIndex;
    uvec2 tile = gl_WorkGroupID.xy, size = push.set.area_size;
    uvec2 at = tile * TILE + uvec2(gl_LocalInvocationID.x, ROWS * gl_LocalInvocationID.y);
    ivec2 origin = push.set.area_origin;
    vec4 viewport = push.set.viewport;
    vec2 center = vec2(ivec2(at) + origin) + 0.5, middle = vec2(ivec2(tile * TILE) + origin) + 8.0;
    float dx = float(at.x & 15u) - 7.5, dy = float(at.y & 15u) - 7.5;
    center_x = center.x;
    vec4 down = vec4(0.0, 1.0, 2.0, 3.0), rows = center.y + down;
    bool is_column = at.x < size.x && center.x >= viewport.x && center.x < viewport.x + viewport.z;
    goes_on = bvec4(uvec4(lessThan(uvec4(at.y) + uvec4(down), uvec4(size.y))) & uvec4(greaterThanEqual(rows, vec4(viewport.y)))
                    & uvec4(lessThan(rows, vec4(viewport.y + viewport.w))) & uint(is_column));
    uint plane = push.plane + (HAS_TESTS ? gl_WorkGroupID.z * size.x * size.y : 0u);
    if (HAS_TESTS) {
        stored = vec4(0.0);
        median = vec4(0.0);
        is_touched = bvec4(false);
        for (uint j = 0u; j < ROWS; j++) {
            uvec2 before = uvec2(0u, OUT_OF_BOUNDS);
            if (goes_on[j]) {
                before = push.set.stored.at[plane + (at.y + j) * size.x + at.x];
            }
            stored[j] = uintBitsToFloat(before.x);
            has_passed_stencil[j] = before.y == GOES_ON;
            goes_on[j] = goes_on[j] && before.y != OUT_OF_BOUNDS;
        }
    }
    if (HAS_CUT_TILES) {
        cut_column = uint(floor(max(center.x - viewport.x, 0.0) / 16.0));
        cut_rows = uvec4(floor(max(rows - viewport.y, vec4(0.0)) / 16.0));
    }

    // lavapipe runs bodies of loops that no invocation enters, and 26.2 then reads at addresses that are the same for all of them: members
    // must be Gaussians even so.
    members[l] = members[l + INVOCATIONS] = 0u;
    barrier();

    // Where the pairs did not fit, every Gaussian that is seen is looked at.
    uint copies_ = HAS_ANGLES ? copies() : 1u;
    bool is_overflow = push.set.counters.at[PAIRS] != push.set.counters.at[STORED];
    uvec2 range = is_overflow ? uvec2(0u, push.set.counters.at[SEEN] * copies_) : push.set.ranges.at[tile.y * push.set.tiles.x + tile.x];
    if (range.x == range.y) {
        return;
    }
    Words values = push.set.pair_values;
    uint from = push.side == 0u ? 0u : push.set.pair_capacity;
    floor_ = push.set.alpha_floor;
    ceiling = push.set.alpha_ceiling;
    end = push.set.transmittance_floor;
    float least = log2(max(floor_, 1.2e-38)), deviations = push.set.cut_off_deviations;
    // In the exponent's units: k^2 / (2 ln 2).
    float ellipse = push.set.cut_off == ELLIPSE ? 0.7213475204 * deviations * deviations : 3.4e38;

    is_reached = bvec4(false);
    transmittance = vec4(1.0);
    for (uint j = 0u; j < ROWS; j++) {
        total[j] = vec3(0.0);
    }
    if (IS_RESOLVED) {
        nearest = median_of = uvec4(0u);
        near_depth = near_distance = total_weight = total_depth = total_distance = vec4(0.0);
    }
    // Batches are the same in both cases, so that sums are.
    uint next = range.x, found = 0u;
    while (true) {
        if (is_overflow) {
            // The next Gaussians that reach the tile.
            while (found < BATCH && next < range.y) {
                found += gather(next + l, range.y, found, tile, copies_);
                next += INVOCATIONS;
            }
        }
        uint count = min(BATCH, is_overflow ? found : range.y - next);
        if (count == 0u) {
            break;
        }
        if (l == 0u) {
            unfinished = 0u;
            steep = 0u;
        }
        barrier();
        if (any(goes_on)) {
            atomicOr(unfinished, 1u);
        }
        for (uint m = l; m < count; m += INVOCATIONS) {
            uint member = is_overflow ? waiting[m] : values.at[from + next + m];
            admit(m, member, middle, least, ellipse);
        }
        barrier();
        if (unfinished == 0u) {
            break;
        }
        for (uint j = 0u; j < ROWS; j++) {
            sum[j] = vec3(0.0);
        }
        if (IS_RESOLVED) {
            sum_weight = sum_depth = sum_distance = vec4(0.0);
        }
        // Loops, not branches: some devices execute both sides of every branch.
        uint end_of_flat = steep == 0u ? count : 0u, k = 0u;
        while (k < end_of_flat && subgroupAny(any(goes_on))) {
            // The next that reaches a pixel of the subgroup.
            vec4 exponent;
            bool is_next = false;
            while (k < end_of_flat) {
                vec4 line = lines[k];
                vec2 scalar = scalars[k].xy;
                if (IS_SURFEL) {
                    vec4 plane = planes[2u * k], more = planes[2u * k + 1u], row = dy + down;
                    vec4 u = (line.x + line.z * row) + line.y * dx, v = (line.w + plane.y * row) + plane.x * dx;
                    vec4 w = (plane.z + more.x * row) + plane.w * dx, away = more.w + row;
                    exponent = surfel_exponent(u, v, w, more.y, (more.z + dx) * (more.z + dx) + away * away);
                } else {
                    precise float p = line.x + line.z * dx;
                    precise float square = p * p, along = line.w * dx;
                    precise vec4 q = (line.y + scalar.x * (dy + down)) + along;
                    precise vec4 both = square + q * q;
                    exponent = -both;
                }
                is_next = subgroupAny(any(bvec4(uvec4(greaterThanEqual(exponent, vec4(scalar.y))) & uvec4(goes_on))));
                if (is_next) {
                    break;
                }
                k++;
            }
            if (is_next) {
                // The native function is exact enough near 0. 2^whole is made of its bits.
                vec4 whole = floor(exponent + 0.5);
                uvec4 power = uvec4(ivec4(max(whole, vec4(-126.0))) + 127) << 23;
                accumulate(k, exponent, scalars[k].z * exp2(exponent - whole) * uintBitsToFloat(power));
                k++;
            }
        }
        for (k = steep == 0u ? count : 0u; k < count; k++) {
            uint member = members[min(k, BATCH - 1u)];
            Record r = record_of(member);
            vec2 x = add(two_sum(center.x, -r.mean_x.x), pair(-r.mean_x.y));
            vec4 exponent, rest = vec4(0.0);
            if (IS_SURFEL) {
                Surfel s = surfel_of(r);
                vec4 u, v, w, square;
                Rectangle rectangle = Rectangle(vec2(0.0), vec2(0.0), 0u, 0u);
                if (HAS_CUT_TILES) {
                    rectangle = push.set.rectangles.at[member];
                }
                vec2 from_x = sub(x, rectangle.shift_x);
                for (uint j = 0u; j < ROWS; j++) {
                    vec2 y = add(two_sum(rows[j], -r.mean_y.x), pair(-r.mean_y.y));
                    u[j] = add(mul(s.ux, x), mul(s.uy, y)).x;
                    v[j] = add(mul(s.vx, x), mul(s.vy, y)).x;
                    w[j] = add(pair(1.0), add(mul(s.wx, x), mul(s.wy, y))).x;
                    vec2 from_y = sub(y, rectangle.shift_y);
                    square[j] = add(mul(from_x, from_x), mul(from_y, from_y)).x;
                }
                exponent = surfel_exponent(u, v, w, s.limit, square);
            } else {
                vec2 p = mul(r.f0, x), square = mul(p, p), along = mul(r.f1, x);
                for (uint j = 0u; j < ROWS; j++) {
                    vec2 y = add(two_sum(rows[j], -r.mean_y.x), pair(-r.mean_y.y)), q = add(along, mul(r.f2, y));
                    vec2 both = -add(square, mul(q, q));
                    exponent[j] = both.x;
                    rest[j] = both.y;
                }
            }
            vec4 whole = floor(exponent + 0.5);
            precise vec4 part = (exponent - whole) + rest;
            accumulate(k, exponent, ldexp(r.opacity * exp2(part), ivec4(max(whole, vec4(-300.0)))));
        }
        for (uint j = 0u; j < ROWS; j++) {
            total[j] += sum[j];
        }
        if (IS_RESOLVED) {
            total_weight += sum_weight;
            total_depth += sum_depth;
            total_distance += sum_distance;
        }
        barrier();
        if (is_overflow) {
            // What is left, less than the number of invocations, is the beginning of the next batch.
            uint rest = count + l < found ? waiting[count + l] : 0u;
            barrier();
            waiting[l] = rest;
            found -= count;
            barrier();
        } else {
            next += count;
        }
    }
    Pixels image = push.set.image;
    if (any(is_reached) || (HAS_TESTS && any(is_touched))) {
        push.set.shown.at[(push.view * push.set.tiles.y + tile.y) * push.set.tiles.x + tile.x] = 1u;
    }
    for (uint j = 0u; j < ROWS; j++) {
        if (at.x < size.x && at.y + j < size.y) {
            uint pixel = plane + (at.y + j) * size.x + at.x;
            image.at[pixel] = is_reached[j] ? vec4(total[j], 1.0 - transmittance[j]) : vec4(0.0, 0.0, 0.0, outcome(j));
            if (IS_RESOLVED && is_reached[j]) {
                vec2 own = push.set.depths.at[median_of[j]], mean = own;
                // Weights may underflow.
                if (total_weight[j] > 0.0) {
                    mean = vec2(near_depth[j], near_distance[j]) + vec2(total_depth[j], total_distance[j]) / total_weight[j];
                }
                uint steps = push.set.depth_steps;
                if (steps != 0u) {
                    mean.x = mean.x / float(steps);
                    own.x = div(pair(own.x), pair(float(steps))).x;
                }
                push.set.inputs.at[2u * pixel] = floatBitsToUint(vec4(mean.x, own.x, mean.y, own.y));
                push.set.inputs.at[2u * pixel + 1u] = uvec4(push.set.names.at[median_of[j]], push.set.names.at[nearest[j]]);
            }
            if (HAS_TESTS) {
                uint steps = push.set.depth_steps;
                push.set.medians.at[pixel] = steps == 0u ? median[j] : div(pair(median[j]), pair(float(steps))).x;
            }
        }
    }
}
