#version 460
// Counts the set's Gaussians, which indirect draws know only now, and derives what all of them need of the view's camera.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "set.glsl"
#include "variant.glsl"
#include "attributes.glsl"
#include "pair.glsl"
#include "angles.glsl"
layout(local_size_x = 256) in;
shared uint before[256];

// The number of Gaussians of a draw, at most 2^24 - 1.
uint resolve(uint index) {
    Draw d = push.set.draws.at[index];
    if (d.parameters != uvec2(0u)) {
        uvec2 at = d.parameters;
        d.count = word_at(at);
        d.instances = word_at(advanced(at, 4u));
        d.first = word_at(advanced(at, 8u));
        uint next = word_at(advanced(at, 12u));
        if (d.is_indexed != 0u) {
            d.vertex_offset = int(next);
            d.first_instance = word_at(advanced(at, 16u));
        } else {
            d.first_instance = next;
        }
        if (d.draw_count != uvec2(0u) && d.indirect_index >= word_at(d.draw_count)) {
            d.count = 0u;
        }
        push.set.draws.at[index].count = d.count;
        push.set.draws.at[index].instances = d.instances;
        push.set.draws.at[index].first = d.first;
        push.set.draws.at[index].vertex_offset = d.vertex_offset;
        push.set.draws.at[index].first_instance = d.first_instance;
    }
    if (d.shaded.outputs != uvec2(0u)) {
        // What indices name is known by the host alone.
        Shaded own = d.shaded;
        own.first_vertex = d.is_indexed != 0u ? 0u : d.first;
        own.vertices = d.is_indexed != 0u ? own.vertices : min(d.count, own.capacity);
        own.instances = own.vertices == 0u ? 0u : min(d.instances, own.capacity / own.vertices);
        own.first_instance = d.first_instance;
        own.command[0] = d.is_indexed != 0u ? d.count : own.vertices;
        own.command[1] = own.instances;
        own.command[2] = d.first;
        own.command[3] = d.is_indexed != 0u ? uint(d.vertex_offset) : d.first_instance;
        own.command[4] = d.first_instance;
        push.set.draws.at[index].shaded = own;
    }
    uint high, low;
    umulExtended(d.count, d.instances, high, low);
    return high != 0u ? 0xffffffu : min(low, 0xffffffu);
}

bool is_finite(float x) {
    return !isnan(x) && !isinf(x);
}

bool is_valid(Camera camera) {
    bool valid = camera.model >= PINHOLE && camera.model <= (push.set.is_surfel != 0u ? ORTHOGRAPHIC : EQUIRECTANGULAR);
    for (int i = 0; i < 3; i++) {
        valid = valid && (camera.eye[i].y >> 20 & 0x7ffu) != 0x7ffu;
        for (int j = 0; j < 3; j++) {
            valid = valid && is_finite(camera.rotation[i][j]);
        }
    }
    for (int i = 0; i < 2; i++) {
        valid = valid && is_finite(camera.principal_point[i]) && is_finite(camera.depth_coefficients[i]);
        valid = valid && is_finite(camera.focal_length[i]) && camera.focal_length[i] > 0.0;
    }
    valid = valid && is_finite(camera.near_plane) && camera.far_plane > camera.near_plane;
    return valid && (camera.model == ORTHOGRAPHIC || camera.near_plane > 0.0);
}

void derive() {
    Camera camera = push.set.cameras.at[min(push.view, push.set.camera_count - 1u)];
    for (int i = 0; i < 3; i++) {
        push.set.derived.of.eye[i] = in_three(camera.eye[i]);
    }
    vec2 turn = mul(PI, 2.0 * camera.focal_length.x);
    push.set.derived.of.period = camera.model == EQUIRECTANGULAR ? turn : vec2(0.0);
    // The slopes' limits: to the viewport's edges and 0.15 of its size beyond.
    for (int i = 0; i < 2; i++) {
        float size = push.set.viewport[2 + i];
        vec2 focal = pair(camera.focal_length[i]), center = pair(camera.principal_point[i]);
        vec2 beyond = div(mul(vec2(0.15, -5.9604645e-9), size), focal);
        push.set.derived.of.limits[2 * i] = add(div(sub(pair(size), center), focal), beyond);
        push.set.derived.of.limits[2 * i + 1] = add(div(center, focal), beyond);
    }
    // A lens that sees more does so within bounds that are as much wider.
    if (any(notEqual(uvec2(push.set.lenses), uvec2(0u)))) {
        Lens lens = push.set.lenses.at[min(push.view, push.set.camera_count - 1u)];
        for (int i = 0; lens.model != 0u && i < 4; i++) {
            bool is_bounded = lens.widening.x < 1e30;
            push.set.derived.of.limits[i] = is_bounded ? mul(push.set.derived.of.limits[i], lens.widening) : pair(3.4e38);
        }
    }
}

// The camera as a resolve shader reads it, at six locations.
void show_camera() {
    Camera camera = push.set.cameras.at[min(push.view, push.set.camera_count - 1u)];
    uint first = 6u * push.view;
    vec3 eye;
    for (int j = 0; j < 3; j++) {
        vec3 parts = push.set.derived.of.eye[j];
        precise float rest = parts.y + parts.z;
        precise float sum = parts.x + rest;
        eye[j] = sum;
    }
    for (int r = 0; r < 3; r++) {
        vec2 moved = vec2(0.0);
        for (int c = 0; c < 3; c++) {
            float turn = camera.rotation[r][c];
            vec3 parts = push.set.derived.of.eye[c];
            moved = add(moved, two_product(turn, parts.x));
            moved = add(moved, add(two_product(turn, parts.y), two_product(turn, parts.z)));
        }
        push.set.seen_by.at[first + uint(r)] = vec4(camera.rotation[r].xyz, -moved.x);
    }
    push.set.seen_by.at[first + 3u] = vec4(camera.focal_length, camera.principal_point);
    push.set.seen_by.at[first + 4u] = vec4(camera.depth_coefficients, camera.near_plane, camera.far_plane);
    push.set.seen_by.at[first + 5u] = vec4(eye, float(camera.model));
}

void main() {
    uint l = gl_LocalInvocationIndex;
    uint all = 0u;
    for (uint first = 0u; first < push.set.draw_count; first += 256u) {
        uint index = first + l;
        uint own = index < push.set.draw_count ? resolve(index) : 0u;
        before[l] = own;
        barrier();
        for (uint d = 1u; d < 256u; d <<= 1) {
            uint other = l >= d ? before[l - d] : 0u;
            barrier();
            before[l] = min(before[l] + other, 0x7fffffffu);
            barrier();
        }
        if (index < push.set.draw_count) {
            push.set.draws.at[index].base = min(all + before[l] - own, 0x7fffffffu);
        }
        all = min(all + before[255], 0x7fffffffu);
        barrier();
    }
    if (l != 0u) {
        return;
    }
    bool valid = push.set.camera_count > 0u || push.set.is_shaded != 0u;
    for (uint i = 0u; i < push.set.camera_count; i++) {
        valid = valid && is_valid(push.set.cameras.at[i]);
    }
    uint n = valid ? min(all, push.set.reserve) : 0u;
    if (push.set.is_shaded == 0u) {
        derive();
    } else {
        push.set.derived.of.period = vec2(0.0);
    }
    if (any(notEqual(uvec2(push.set.seen_by), uvec2(0u)))) {
        show_camera();
    }
    Words counters = push.set.counters;
    counters.at[GAUSSIANS] = n;
    counters.at[SEEN] = 0u;
    counters.at[PAIRS] = 0u;
    counters.at[STORED] = 0u;
    set_groups(counters, BY_GAUSSIAN, blocks(n, 256u));
    set_groups(counters, SORT_GAUSSIANS, blocks(n, BLOCK));
}
