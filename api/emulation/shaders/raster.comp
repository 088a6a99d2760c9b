#version 460
// Accumulates the Gaussians of a tile front to back: a workgroup is a tile, an invocation a pixel. A pixel without a contribution gets
// a negative alpha.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "set.glsl"
#include "pair.glsl"
#include "tiles.glsl"
layout(local_size_x = 16, local_size_y = 16) in;
// Of the Gaussians of a batch: what gives the exponent at a pixel, opacity, exponent at which alpha is below the floor; colour; index.
shared vec4 lines[256];
shared vec4 scalars[256];
shared vec4 colors[256];
shared uvec4 members[256];
shared uint unfinished;
// Of a batch of which only some reach the tile, a bit for each that does.
shared uint reaching[8];

const uint NOBODY = 0xffffffffu;

// Of the pixel: what has accumulated, whether anything has, and whether it is finished.
vec3 sum, rest;
float transmittance;
bool done, is_reached;
// The pixel's tile of cut-offs.
uvec2 cut_tile;
// Of the set.
float floor_, ceiling, end, ellipse;

// Whether the cut-off of a Gaussian leaves the pixel out.
bool is_cut(uint l) {
    uint x = members[l].y, y = members[l].z;
    return cut_tile.x < (x & 0xffffu) || cut_tile.x >= x >> 16 || cut_tile.y < (y & 0xffffu) || cut_tile.y >= y >> 16;
}

// Accumulates the Gaussian of a place in the batch, whose alpha is its opacity times 2^exponent.
void accumulate(uint k, vec2 exponent) {
    vec4 scalar = scalars[k];
    float whole = floor(exponent.x + 0.5);
    precise float part = (exponent.x - whole) + exponent.y;
    float alpha = min(ceiling, ldexp(scalar.y * exp2(part), int(max(whole, -300.0))));
    bool is_in = exponent.x > scalar.z && -exponent.x <= ellipse && alpha >= floor_ && !is_cut(k);
    precise float next = transmittance * (1.0 - alpha);
    done = is_in && next < end;
    if (is_in && !done) {
        is_reached = true;
        // Kahan's sum: ten thousand layers are as exact as one.
        precise float weight = transmittance * alpha;
        precise vec3 added = weight * colors[k].xyz - rest;
        precise vec3 larger = sum + added;
        precise vec3 lost = (larger - sum) - added;
        rest = lost;
        sum = larger;
        transmittance = next;
    }
}

void main() {
    uint l = gl_LocalInvocationIndex;
    uvec2 tile = gl_WorkGroupID.xy, at = gl_GlobalInvocationID.xy;
    bool is_inside = all(lessThan(at, push.set.area_size));
    ivec2 place = ivec2(at) + push.set.area_origin;
    vec2 center = vec2(place) + 0.5;
    vec2 middle = vec2(ivec2(tile * TILE) + push.set.area_origin) + 8.0;
    float dx = float(at.x & 15u) - 7.5, dy = float(at.y & 15u) - 7.5;
    is_inside = is_inside && all(greaterThanEqual(center, push.set.viewport.xy))
        && all(lessThan(center, push.set.viewport.xy + push.set.viewport.zw));

    // Where the pairs did not fit, every Gaussian that is seen is looked at.
    bool is_overflow = push.set.counters.at[PAIRS] != push.set.counters.at[STORED];
    uvec2 range = uvec2(0u, push.set.counters.at[SEEN]);
    if (!is_overflow) {
        range = push.set.ranges.at[tile.y * push.set.tiles.x + tile.x];
    }
    uint from = push.side == 0u ? 0u : push.set.pair_capacity;
    floor_ = push.set.alpha_floor;
    ceiling = push.set.alpha_ceiling;
    end = push.set.transmittance_floor;
    bool has_tiles = push.set.cut_off >= TILE_SQUARE;
    cut_tile = has_tiles ? uvec2(floor(max(center - push.set.viewport.xy, vec2(0.0)) / 16.0)) : uvec2(0u);
    float least = log2(max(floor_, 1.2e-38)), deviations = push.set.cut_off_deviations;
    // In the exponent's units: k^2 / (2 ln 2).
    ellipse = push.set.cut_off == ELLIPSE ? 0.7213475204 * deviations * deviations : 3.4e38;

    done = !is_inside;
    is_reached = false;
    sum = vec3(0.0);
    rest = vec3(0.0);
    transmittance = 1.0;
    for (uint first = range.x; first < range.y; first += 256u) {
        if (l == 0u) {
            unfinished = 0u;
        }
        barrier();
        if (!done) {
            atomicOr(unfinished, 1u);
        }
        uint index = NOBODY;
        if (first + l < range.y) {
            if (is_overflow) {
                index = push.set.values.at[first + l];
                uint rows = push.set.records.at[index].tiles_y;
                uvec2 row = tile.y >= (rows & 0xffffu) && tile.y <= rows >> 16 ? tiles_of_row(index, tile.y) : uvec2(0u);
                index = tile.x >= row.x && tile.x < row.y ? index : NOBODY;
            } else {
                index = push.set.pair_values.at[from + first + l];
            }
        }
        // The place in the batch: those that reach the tile move together, in their order.
        uint slot = l, count = min(256u, range.y - first);
        if (is_overflow) {
            if (l < 8u) {
                reaching[l] = 0u;
            }
            barrier();
            if (index != NOBODY) {
                atomicOr(reaching[l >> 5], 1u << (l & 31u));
            }
            barrier();
            slot = bitCount(reaching[l >> 5] & ((1u << (l & 31u)) - 1u));
            count = 0u;
            for (uint k = 0u; k < 8u; k++) {
                uint own = bitCount(reaching[k]);
                slot += k < l >> 5 ? own : 0u;
                count += own;
            }
        }
        if (index != NOBODY) {
            members[slot].x = index;
            Record r = push.set.records.at[index];
            vec2 x = add(two_sum(middle.x, -r.mean_x.x), pair(-r.mean_x.y)), y = add(two_sum(middle.y, -r.mean_y.x), pair(-r.mean_y.y));
            lines[slot] = vec4(mul(r.f0, x).x, add(mul(r.f1, x), mul(r.f2, y)).x, r.f0.x, r.f1.x);
            // Steep exponents and large opacities need pairs at every pixel.
            bool is_steep = max(abs(r.f0.x), max(abs(r.f1.x), abs(r.f2.x))) > 3.0 || r.opacity > 16.0;
            scalars[slot] = vec4(r.f2.x, r.opacity, least - log2(r.opacity) - 0.1, is_steep ? 1.0 : 0.0);
            colors[slot] = vec4(r.red, r.green, r.blue, 0.0);
            // Without a cut-off by tiles, all are within.
            members[slot].yz = has_tiles ? uvec2(r.cut_x, r.cut_y) : uvec2(0xffff0000u);
        }
        barrier();
        if (unfinished == 0u) {
            break;
        }
        // Steep ones have a loop of their own: some devices execute both sides of every branch.
        uint k = 0u;
        while (k < count && !done) {
            while (k < count && !done && scalars[k].w == 0.0) {
                vec4 line = lines[k];
                precise float p = line.x + line.z * dx;
                precise float q = (line.y + scalars[k].x * dy) + line.w * dx;
                precise float exponent = -(p * p + q * q);
                accumulate(k, vec2(exponent, 0.0));
                k++;
            }
            while (k < count && !done && scalars[k].w != 0.0) {
                Record r = push.set.records.at[members[k].x];
                vec2 x = add(two_sum(center.x, -r.mean_x.x), pair(-r.mean_x.y));
                vec2 y = add(two_sum(center.y, -r.mean_y.x), pair(-r.mean_y.y));
                vec2 p = mul(r.f0, x), q = add(mul(r.f1, x), mul(r.f2, y));
                accumulate(k, -add(mul(p, p), mul(q, q)));
                k++;
            }
        }
        barrier();
    }
    if (all(lessThan(at, push.set.area_size))) {
        push.set.image.at[push.plane + at.y * push.set.area_size.x + at.x] = is_reached ? vec4(sum, 1.0 - transmittance) : vec4(0.0, 0.0, 0.0, -1.0);
    }
}
