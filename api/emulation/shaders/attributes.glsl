// Attributes of vertices, by address and in any format that vertex buffers have.

layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer Word { uint word; };

// Kinds of formats, as src/formats.rs has them. A format is kind | components << 8.
const uint FLOAT32 = 0u, FLOAT16 = 1u, UNORM8 = 2u, SNORM8 = 3u, UNORM16 = 4u, SNORM16 = 5u, USCALED8 = 6u, SSCALED8 = 7u,
           USCALED16 = 8u, SSCALED16 = 9u, BGRA8 = 10u, A2B10G10R10_UNORM = 11u, A2B10G10R10_SNORM = 12u,
           A2R10G10B10_UNORM = 13u, A2R10G10B10_SNORM = 14u, A2B10G10R10_USCALED = 15u, A2B10G10R10_SSCALED = 16u,
           A2R10G10B10_USCALED = 17u, A2R10G10B10_SSCALED = 18u, B10G11R11 = 19u, UINT8 = 20u, UINT16 = 21u, UINT32 = 22u;

uvec2 advanced(uvec2 address, uint bytes) {
    uint carry;
    uint low = uaddCarry(address.x, bytes, carry);
    return uvec2(low, address.y + carry);
}

uint word_at(uvec2 address) {
    return Word(uvec2(address.x & ~3u, address.y)).word;
}

uint half_at(uvec2 address) {
    // The first byte may be odd.
    uint shift = (address.x & 3u) * 8u;
    uint low = word_at(address) >> shift;
    return (shift == 24u ? low | word_at(advanced(address, 1u)) << 8 : low) & 0xffffu;
}

uint byte_at(uvec2 address) {
    return word_at(address) >> ((address.x & 3u) * 8u) & 0xffu;
}

uint any_word_at(uvec2 address) {
    uint shift = (address.x & 3u) * 8u;
    uint low = word_at(address);
    return shift == 0u ? low : low >> shift | word_at(advanced(address, 4u)) << (32u - shift);
}

int signed_bits(uint value, uint bits) {
    return int(value << (32u - bits)) >> (32u - bits);
}

float small_float(uint bits, uint fraction_bits) {
    // Unsigned, with five bits of exponent: as a half float.
    return unpackHalf2x16(bits << (10u - fraction_bits)).x;
}

uint format_bytes(uint format) {
    uint kind = format & 0xffu, components = format >> 8;
    if (kind == FLOAT32) {
        return 4u * components;
    }
    if (kind >= UINT8) {
        return kind == UINT32 ? 4u : components << kind - UINT8;
    }
    if (kind >= BGRA8) {
        return 4u;
    }
    bool is_byte = kind == UNORM8 || kind == SNORM8 || kind == USCALED8 || kind == SSCALED8;
    return is_byte ? components : 2u * components;
}

float component(uint kind, uvec2 address, uint index) {
    if (kind == FLOAT32) {
        return uintBitsToFloat(any_word_at(advanced(address, 4u * index)));
    }
    if (kind == UNORM8 || kind == SNORM8 || kind == USCALED8 || kind == SSCALED8) {
        uint value = byte_at(advanced(address, index));
        if (kind == UNORM8) {
            return float(value) / 255.0;
        }
        if (kind == USCALED8) {
            return float(value);
        }
        float whole = float(signed_bits(value, 8u));
        return kind == SNORM8 ? max(whole / 127.0, -1.0) : whole;
    }
    uint value = half_at(advanced(address, 2u * index));
    if (kind == FLOAT16) {
        return unpackHalf2x16(value).x;
    }
    if (kind == UNORM16) {
        return float(value) / 65535.0;
    }
    if (kind == USCALED16) {
        return float(value);
    }
    float whole = float(signed_bits(value, 16u));
    return kind == SNORM16 ? max(whole / 32767.0, -1.0) : whole;
}

vec4 packed_element(uint kind, uint word) {
    if (kind == BGRA8) {
        vec4 value = unpackUnorm4x8(word);
        return value.bgra;
    }
    if (kind == B10G11R11) {
        return vec4(small_float(word & 0x7ffu, 6u), small_float(word >> 11 & 0x7ffu, 6u), small_float(word >> 22, 5u), 1.0);
    }
    uvec4 bits = uvec4(word & 0x3ffu, word >> 10 & 0x3ffu, word >> 20 & 0x3ffu, word >> 30);
    bool is_red_first = kind == A2B10G10R10_UNORM || kind == A2B10G10R10_SNORM || kind == A2B10G10R10_USCALED
        || kind == A2B10G10R10_SSCALED;
    if (!is_red_first) {
        bits.xyz = bits.zyx;
    }
    if (kind == A2B10G10R10_UNORM || kind == A2R10G10B10_UNORM) {
        return vec4(bits) / vec4(1023.0, 1023.0, 1023.0, 3.0);
    }
    if (kind == A2B10G10R10_USCALED || kind == A2R10G10B10_USCALED) {
        return vec4(bits);
    }
    vec4 whole = vec4(signed_bits(bits.x, 10u), signed_bits(bits.y, 10u), signed_bits(bits.z, 10u), signed_bits(bits.w, 2u));
    bool is_scaled = kind == A2B10G10R10_SSCALED || kind == A2R10G10B10_SSCALED;
    return is_scaled ? whole : max(whole / vec4(511.0, 511.0, 511.0, 1.0), vec4(-1.0));
}

// The first components of an element, as many as are wanted; an element that does not lie within the bytes is zeros.
vec4 element(uvec2 address, uint offset, bool is_within, uint format, uint wanted) {
    vec4 value = vec4(0.0, 0.0, 0.0, is_within ? 1.0 : 0.0);
    if (!is_within) {
        return value;
    }
    address = advanced(address, offset);
    uint kind = format & 0xffu;
    if (kind >= BGRA8) {
        return packed_element(kind, any_word_at(address));
    }
    uint count = min(format >> 8, wanted);
    for (uint i = 0u; i < count; i++) {
        value[i] = component(kind, address, i);
    }
    return value;
}

// Whether `bytes` from index * stride + offset on lie within `size`; that place, modulo 2^32.
bool lies_within(uint index, uint stride, uint offset, uint bytes, uint size, out uint place) {
    uint high, low, carry;
    umulExtended(index, stride, high, low);
    place = uaddCarry(low, offset, carry);
    return high == 0u && carry == 0u && place <= size && size - place >= bytes;
}

// The element's place in its buffer, if it lies within.
struct Place {
    uvec2 address;
    uint offset, bytes;          // the buffer's
    bool is_within;              // before the buffer's end
};

Place place_of(uint draw, Attribute a, uint vertex, uint instance, uint first_instance) {
    Source source = push.set.sources.at[draw * push.set.source_count + a.source];
    uint index = vertex;
    if (source.divisor == 0u) {
        index = first_instance;
    } else if (source.divisor != 0xffffffffu) {
        index = first_instance + (instance - first_instance) / source.divisor;
    }
    Place p = Place(source.address, 0u, source.bytes, false);
    p.is_within = lies_within(index, source.stride, a.offset, format_bytes(a.format), source.bytes, p.offset);
    return p;
}

// The first components of 32-bit floats.
vec4 floats(uvec2 address, uint offset, bool is_within, uint wanted) {
    vec4 value = vec4(0.0);
    if (is_within) {
        uvec2 at = advanced(address, offset);
        for (uint i = 0u; i < wanted; i++) {
            value[i] = uintBitsToFloat(Word(advanced(at, 4u * i)).word);
        }
    }
    return value;
}

vec4 read_attribute(uint draw, uint which, uint vertex, uint instance, uint first_instance, uint wanted) {
    Attribute a = push.set.attributes[which];
    Place p = place_of(draw, a, vertex, instance, first_instance);
    if (IS_FLOAT32) {
        return floats(p.address, p.offset, p.is_within, wanted);
    }
    return element(p.address, p.offset, p.is_within, a.format, wanted);
}
