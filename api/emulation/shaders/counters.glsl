// Counters of a set, and the sizes of dispatches that follow from them.

layout(buffer_reference, std430, buffer_reference_align = 4) buffer Words { uint at[]; };

// Places in the counters: the numbers of Gaussians, of those that are seen, of pairs, and of pairs that fit the arrays.
const uint GAUSSIANS = 0u, SEEN = 1u, PAIRS = 2u, STORED = 3u;
// Workgroups of indirect dispatches, three words each.
const uint BY_GAUSSIAN = 4u, SORT_GAUSSIANS = 7u, BY_SEEN = 10u, SORT_SEEN = 13u, BY_PAIR = 16u, SORT_PAIRS = 19u;

// The key of a Gaussian that is not seen.
const uint NOT_SEEN = 0xffffffffu;
// Keys of a workgroup in sorts and scans.
const uint BLOCK = 2048u;

uint blocks(uint count, uint size) {
    return count / size + uint(count % size != 0u);
}

// The workgroup's number in a dispatch whose groups are spread over two dimensions.
uint group() {
    return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
}

void set_groups(Words counters, uint place, uint groups) {
    const uint wide = 32768u;
    counters.at[place] = min(groups, wide);
    counters.at[place + 1u] = blocks(groups, wide);
    counters.at[place + 2u] = 1u;
}
