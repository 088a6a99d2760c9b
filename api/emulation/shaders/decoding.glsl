// Decoding: the values that attributes' integers stand for. They are computed as pairs, in either class of precision, and rounded to
// binary32 at the end.

// What the set's word of decodings says: two bits for each attribute, then flags and the decoding of harmonics.
const uint NOT_DECODED = 0u, CHUNK = 1u, CODEBOOK = 2u;
const uint POSITION_CODES = 0u, SCALE_CODES = 2u, ROTATION_CODES = 4u, OPACITY_CODES = 6u, COLOR_CODES = 8u, HARMONICS_CODES = 10u;
const uint SIGNED_LOGARITHMS = 1u << 12, BASE_COLORS = 1u << 13;
const uint SMALLEST_THREE_10 = 1u, SMALLEST_THREE_8 = 2u, HARMONICS_PALETTE = 2u;
// Places in a draw's list of tables.
const uint POSITION_TABLE = 0u, SCALE_TABLE = 1u, OPACITY_TABLE = 2u, COLOR_TABLE = 3u, HARMONICS_TABLE = 4u;

uint decoding_of(uint place) {
    return push.set.decodings >> place & 3u;
}

// A binary64 number as a pair.
vec2 pair_of_bits(uvec2 bits) {
    if ((bits.y & 0x7ff00000u) == 0x7ff00000u) {
        bool is_infinite = (bits.y & 0xfffffu) == 0u && bits.x == 0u;
        return pair(uintBitsToFloat((is_infinite ? 0x7f800000u : 0x7fc00000u) | bits.y & 0x80000000u));
    }
    vec3 parts = in_three(bits);
    return whole_add(quick_two_sum(parts.x, parts.y), pair(parts.z));
}

// A number of a table; 0 if it does not lie within.
vec2 number_at(Table table, uint place, bool is_within) {
    if (!is_within) {
        return vec2(0.0);
    }
    uvec2 at = advanced(table.address, place);
    uint low = any_word_at(at);
    if (table.is_binary64 == 0u) {
        return pair(uintBitsToFloat(low));
    }
    return pair_of_bits(uvec2(low, any_word_at(advanced(at, 4u))));
}

// The number of a codebook that an integer names.
vec2 of_codebook(Table table, uint code) {
    uint size = table.is_binary64 != 0u ? 8u : 4u;
    return number_at(table, code * size, table.bytes >= (code + 1u) * size);
}

// The number that lies so far between a chunk's bounds.
vec2 of_chunk(Table table, uint vertex, uint component, uint components, uint code, uint most) {
    uint size = table.is_binary64 != 0u ? 8u : 4u, place;
    bool is_within = lies_within(vertex / max(table.chunk_size, 1u), table.stride, 0u, 2u * components * size, table.bytes, place);
    vec2 low = number_at(table, place + component * size, is_within);
    vec2 high = number_at(table, place + (components + component) * size, is_within);
    vec2 t = whole_div(pair(float(code)), pair(float(most)));
    vec2 number = whole_add(whole_mul(low, whole_add(pair(1.0), -t)), whole_mul(high, t));
    // Of what is no finite number a pair is none.
    return is_finite(number.x) ? number : pair(low.x * (1.0 - t.x) + high.x * t.x);
}

// The integers of an element: the first components of 8 or 16 bits, or a word.
uvec4 codes_of(Place p, uint format, uint wanted) {
    uvec4 codes = uvec4(0u);
    if (!p.is_within) {
        return codes;
    }
    uvec2 at = advanced(p.address, p.offset);
    uint kind = format & 0xffu;
    if (kind == UINT32) {
        codes.x = any_word_at(at);
        return codes;
    }
    for (uint i = 0u; i < min(format >> 8, wanted); i++) {
        codes[i] = kind == UINT8 ? byte_at(advanced(at, i)) : half_at(advanced(at, 2u * i));
    }
    return codes;
}

// The decoded numbers of an attribute's components, of which there are one or three.
void decode(uint draw, uint which, uint table_place, uint decoding, uvec2 member, uint components, out vec2 numbers[3]) {
    Attribute a = push.set.attributes[which];
    Place p = place_of(draw, a, member.x, member.y, push.set.draws.at[draw].first_instance);
    uvec4 codes = codes_of(p, a.format, components);
    uvec3 most = uvec3((a.format & 0xffu) == UINT16 ? 65535u : 255u);
    if ((a.format & 0xffu) == UINT32) {
        uint word = codes.x;
        bool is_color = which == HARMONICS;
        codes.xyz = is_color ? uvec3(word >> 24, word >> 16 & 255u, word >> 8 & 255u) : uvec3(word >> 21, word >> 11 & 1023u, word & 2047u);
        most = is_color ? uvec3(255u) : uvec3(2047u, 1023u, 2047u);
    }
    Table table = push.set.draws.at[draw].tables[table_place];
    for (uint i = 0u; i < 3u; i++) {
        numbers[i] = vec2(0.0);
        if (i < components) {
            bool is_codebook = decoding == CODEBOOK;
            numbers[i] = is_codebook ? of_codebook(table, codes[i]) : of_chunk(table, member.x, i, components, codes[i], most[i]);
        }
    }
}

// A quaternion without its largest component; zeros where its element does not lie within its buffer.
vec4 decode_rotation(uint draw, uint decoding, uvec2 member) {
    Attribute a = push.set.attributes[ROTATION];
    Place p = place_of(draw, a, member.x, member.y, push.set.draws.at[draw].first_instance);
    if (!p.is_within) {
        return vec4(0.0);
    }
    uvec4 codes = codes_of(p, a.format, 4u);
    uint largest = codes.w - 252u, most = 255u;
    if (decoding == SMALLEST_THREE_10) {
        uint word = codes.x;
        largest = word >> 30;
        codes.xyz = uvec3(word >> 20 & 1023u, word >> 10 & 1023u, word & 1023u);
        most = 1023u;
    } else if (codes.w < 252u) {
        return vec4(1.0, 0.0, 0.0, 0.0);
    }
    vec2 squares = vec2(0.0);
    vec4 quaternion = vec4(0.0);
    uint place = 0u;
    for (uint i = 0u; i < 3u; i++) {
        place += place == largest ? 1u : 0u;
        vec2 t = whole_div(pair(float(codes[i])), pair(float(most)));
        // The root of a half.
        vec2 component = whole_mul(whole_add(2.0 * t, pair(-1.0)), vec2(0.70710677, 1.2101617e-08));
        squares = whole_add(squares, whole_mul(component, component));
        quaternion[place] = component.x;
        place++;
    }
    quaternion[largest] = whole_root(whole_add(pair(1.0), -squares)).x;
    return quaternion;
}

// A coefficient from 1 on.
vec3 decode_harmonics(uint draw, uint vertex, uint k) {
    vec3 coefficient = vec3(0.0);
    Table table = push.set.draws.at[draw].tables[HARMONICS_TABLE];
    Codes codes = push.set.draws.at[draw].codes;
    Labels labels = push.set.draws.at[draw].labels;
    uint entry = vertex, place;
    if (decoding_of(HARMONICS_CODES) == HARMONICS_PALETTE) {
        if (!lies_within(vertex, labels.stride, 0u, 2u, labels.bytes, place)) {
            return coefficient;
        }
        entry = half_at(advanced(labels.address, place));
    }
    uint high, low;
    umulExtended(k - 1u, codes.coefficient_stride, high, low);
    for (uint c = 0u; c < 3u; c++) {
        uint beyond, offset, carry;
        umulExtended(c, codes.component_stride, beyond, offset);
        offset = uaddCarry(offset, low, carry);
        bool is_small = (high | beyond | carry) == 0u;
        if (is_small && lies_within(entry, codes.stride, offset, 1u, codes.bytes, place)) {
            coefficient[c] = of_codebook(table, byte_at(advanced(codes.address, place))).x;
        }
    }
    return coefficient;
}

// The constant coefficient of a colour.
vec2 coefficient_of_color(vec2 color) {
    return whole_div(whole_add(color, pair(-0.5)), vec2(0.28209481, -1.4658846e-08));
}
