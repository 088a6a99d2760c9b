// A digit of a sort: keys and values move from one pair of arrays to another, by eight bits of the keys.

layout(push_constant) uniform Push {
    Words keys, values, sorted_keys, sorted_values;
    Words histogram;             // of each digit, by blocks of keys
    Words totals;                // of each digit
    Words counters;
    uint shift;                  // of the digit
    uint count_place;            // the counter that has the number of keys
    uint is_first_of_depths;     // values are the places of the keys, and what is not seen is dropped
    uint unused;
} push;

uint sorted_count() {
    return push.counters.at[push.count_place];
}

bool is_dropped(uint key) {
    return push.is_first_of_depths != 0u && key == NOT_SEEN;
}
