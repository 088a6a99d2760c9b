// Gaussians as draws name them.

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

// The vertex and the instance of a Gaussian of a draw.
uvec2 member_of(Draw d, uint index) {
    uint within = index - d.base, vertex = d.first + within % d.count, instance = d.first_instance + within / d.count;
    if (d.is_indexed != 0u) {
        vertex = index_at(d, vertex) + uint(d.vertex_offset);
    }
    return uvec2(vertex, instance);
}

// The key of a Gaussian, as an unsigned number in the same order as the numbers that it is sorted by.
uint key_of(float by) {
    uint key = floatBitsToUint(by);
    key = (key & 0x80000000u) != 0u ? ~key : key | 0x80000000u;
    return push.set.order == PRIMITIVE ? 0u : key;
}
