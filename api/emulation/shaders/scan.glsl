// Sums over a workgroup of INVOCATIONS, a multiple of 16.

shared uint scanned[INVOCATIONS];
shared uint sixteens[INVOCATIONS / 16u];

// The sum of what the invocations before this one give, and that of all.
uint sum_before(uint own, out uint all) {
    uint l = gl_LocalInvocationIndex, row = l / 16u, before = 0u;
    scanned[l] = own;
    barrier();
    for (uint i = row * 16u; i < l; i++) {
        before += scanned[i];
    }
    if ((l & 15u) == 15u) {
        sixteens[row] = before + own;
    }
    barrier();
    all = 0u;
    for (uint i = 0u; i < INVOCATIONS / 16u; i++) {
        before += i < row ? sixteens[i] : 0u;
        all += sixteens[i];
    }
    barrier();
    return before;
}
