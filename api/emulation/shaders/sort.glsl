// The keys of the sort that is under way.

uint sorted_count() {
    if (push.sort == 1u) {
        return push.set.counters.at[STORED];
    }
    return push.set.counters.at[push.is_first != 0u ? GAUSSIANS : SEEN];
}

Words sorted_keys() {
    if (push.sort == 1u) {
        return push.set.pair_keys;
    }
    return push.set.keys;
}

Words sorted_values() {
    if (push.sort == 1u) {
        return push.set.pair_values;
    }
    return push.set.values;
}

// The place of a half of the arrays.
uint sorted_half(uint side) {
    uint size = push.sort == 1u ? push.set.pair_capacity : push.set.reserve;
    return side == 0u ? 0u : size;
}

bool is_dropped(uint key) {
    return push.is_first != 0u && key == NOT_SEEN;
}
