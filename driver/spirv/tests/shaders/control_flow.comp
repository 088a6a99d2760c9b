#version 450
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer In { uint inputs[]; };
layout(set = 0, binding = 1) writeonly buffer Out { uint outputs[]; };

uint switched(uint x) {
    uint r = 1u;
    switch (x % 7u) {
        case 0u: r = 10u; break;
        case 1u: r += 3u; // falls through
        case 2u: r *= 5u; break;
        default: r = 100u; // falls through
        case 4u: r += x; break;
        case 5u: return 7777u;
    }
    return r * 2u;
}

uint early(uint x) {
    for (uint i = 0u; i < 10u; i++) {
        if (i == x % 13u) return i * 100u;
        if ((x >> i & 1u) == 0u) continue;
        for (uint j = 0u;; j++) {
            if (j > i) break;
            if (j * i == x % 31u) return j + 1000u;
        }
    }
    return x;
}

uint collatz(uint n) {
    uint steps = 0u;
    do {
        n = (n & 1u) == 0u ? n / 2u : 3u * n + 1u;
        steps++;
    } while (n != 1u && steps < 200u);
    return steps;
}

void swap_if(inout uint a, inout uint b) {
    if (a > b) { uint t = a; a = b; b = t; }
}

uint nested(uint x) {
    uint total = 0u;
    uint a = x, b = 1u;
    for (uint i = 0u; i < 8u; i++) {
        swap_if(a, b);
        switch (i & 3u) {
            case 0u:
                if ((x & 4u) != 0u) continue;
                total += a;
                break;
            case 1u:
                for (uint k = 0u; k < (x & 15u); k++) {
                    if (k == 9u) break;
                    if ((k & 1u) != 0u) continue;
                    total += k * b;
                }
                break;
            case 2u: {
                uint t = a; a = b; b = t + i;
                break;
            }
            default:
                if (total > 5000u) { total -= 5000u; break; }
                total ^= x;
        }
        total = total * 3u + 1u;
    }
    return total + a * b;
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    uint x = inputs[i];
    outputs[4u * i] = switched(x);
    outputs[4u * i + 1u] = early(x);
    outputs[4u * i + 2u] = collatz(x + 1u);
    outputs[4u * i + 3u] = nested(x);
}
