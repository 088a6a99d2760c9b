// Replaces each number by the steps of its Collatz sequence.
@group(0) @binding(0) var<storage, read_write> data: array<u32>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&data) { return; }
    var n = data[id.x];
    var steps = 0u;
    while n > 1u {
        if n % 2u == 0u { n = n / 2u; } else { n = 3u * n + 1u; }
        steps++;
    }
    data[id.x] = steps;
}
