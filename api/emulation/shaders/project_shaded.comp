#version 460
// Places a Gaussian that a vertex shader has projected and coloured, and makes its key of the order. The numbers are those of the
// extension's text, under "Vertex-Shader Projection".
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "set.glsl"
#include "variant.glsl"
#include "attributes.glsl"
#include "pair.glsl"
#include "draws.glsl"
#include "depths.glsl"
#include "tiles.glsl"
#include "footprint.glsl"
layout(local_size_x = 256) in;

// A coordinate of the mean in pixels: half / w times the coordinate, from the viewport's centre.
vec2 pixel(float at, float w, float half_size, vec2 center) {
    return add(mul(div(pair(at), pair(w)), half_size), center);
}

void main() {
    uint i = group() * 256u + gl_LocalInvocationIndex;
    if (i >= push.set.counters.at[GAUSSIANS]) {
        return;
    }
    push.set.keys.at[i] = NOT_SEEN;
    Draw d = push.set.draws.at[draw_of(i)];
    uvec2 member = member_of(d, i);
    Shaded shaded = d.shaded;
    uint vertex = member.x - shaded.first_vertex, instance = member.y - shaded.first_instance;
    if (vertex >= shaded.vertices || instance >= shaded.instances) {
        return;
    }
    uint first = ((push.view * shaded.instances + instance) * shaded.vertices + vertex) * 3u;
    Pixels outputs = Pixels(shaded.outputs);
    vec4 position = outputs.at[first], covariance_and_opacity = outputs.at[first + 1u], color_and_key = outputs.at[first + 2u];
    vec3 covariance = covariance_and_opacity.xyz, color = color_and_key.rgb;
    float opacity = covariance_and_opacity.w, z = position.z, w = position.w;

    // Steps 1 and 2: what is skipped.
    bool usable = are_finite(position) && are_finite(covariance_and_opacity) && are_finite(color_and_key);
    usable = usable && opacity >= push.set.alpha_floor && w > 0.0;
    usable = usable && z >= (push.set.is_negative_one_to_one != 0u ? -w : 0.0) && z <= w;
    if (!usable) {
        return;
    }

    // Step 3: the mean.
    Record r;
    r.mean_x = pixel(position.x, w, push.set.half_size.x, push.set.center[0]);
    r.mean_y = pixel(position.y, w, push.set.half_size.y, push.set.center[1]);
    if (!is_finite(r.mean_x.x) || !is_finite(r.mean_y.x)) {
        return;
    }

    // Step 4: the low-pass, determinants and compensation.
    vec2 low_pass = pair(push.set.low_pass), b = pair(covariance.y);
    vec2 a = two_sum(covariance.x, push.set.low_pass), c = two_sum(covariance.z, push.set.low_pass);
    vec2 area = sub(two_product(covariance.x, covariance.z), two_product(covariance.y, covariance.y));
    vec2 det = add(area, add(mul(two_sum(covariance.x, covariance.z), low_pass), mul(low_pass, low_pass)));
    if (!(a.x > 0.0 && det.x > 0.0) || !is_finite(det.x)) {
        return;
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
    vec2 halves = vec2(sqrt(reach * a.x), sqrt(reach * c.x)) * 1.0001 + 0.01;
    uint reached = set_tiles(r, a, b, c, det, reach, halves, false);
    if (reached == 0u) {
        return;
    }
    set_cut(r, a, b, c, deviations, 0);
    set_factor(r, a, b, det, 0);
    r.opacity = opacity;
    r.red = color.x;
    r.green = color.y;
    r.blue = color.z;
    r.unused0 = 0.0;
    r.unused1 = 0.0;
    push.set.records.at[i] = r;
    push.set.reached.at[i] = reached;
    if (HAS_DEPTHS) {
        push.set.depths.at[i] = vec2(held(div(pair(z), pair(w))), w);
    }
    if (IS_RESOLVED) {
        push.set.names.at[i] = member;
    }
    // Keys of -0 and 0 are equal.
    push.set.keys.at[i] = key_of(color_and_key.w == 0.0 ? 0.0 : color_and_key.w);
}
