"""slangpy: Slang code on Vulkan, called over arrays and dispatched as a kernel, compared with numpy."""

import tempfile
from pathlib import Path

import numpy as np
import slangpy

SOURCE = """
float length_of(float x, float y) { return sqrt(x * x + y * y); }

[shader("compute")]
[numthreads(64, 1, 1)]
void prefix(uint3 id: SV_DispatchThreadID, uint lane: SV_GroupIndex,
            StructuredBuffer<uint> source, RWStructuredBuffer<uint> result)
{
    groupshared uint sums[64];
    sums[lane] = source[id.x];
    GroupMemoryBarrierWithGroupSync();
    for (uint step = 1; step < 64; step *= 2) {
        uint before = lane >= step ? sums[lane - step] : 0;
        GroupMemoryBarrierWithGroupSync();
        sums[lane] += before;
        GroupMemoryBarrierWithGroupSync();
    }
    result[id.x] = sums[lane];
}
"""
folder = Path(tempfile.mkdtemp())
SOURCE = SOURCE.replace("    groupshared uint sums[64];\n", "").replace(
    "[shader", "groupshared uint sums[64];\n\n[shader", 1
)
(folder / "kernels.slang").write_text(SOURCE)
# slangpy's own shader library lies beside its Python code.
paths = [folder, Path(slangpy.__file__).parent / "slang"]
device = slangpy.Device(type=slangpy.DeviceType.vulkan, compiler_options={"include_paths": paths})

random = np.random.default_rng(1)
source = random.integers(0, 1000, 64 * 100, dtype=np.uint32)
usage = slangpy.BufferUsage.shader_resource | slangpy.BufferUsage.unordered_access
buffers = [device.create_buffer(element_count=source.size, struct_size=4, usage=usage) for _ in range(2)]
buffers[0].copy_from_numpy(source)
program = device.load_program("kernels", ["prefix"])
kernel = device.create_compute_kernel(program)
kernel.dispatch([source.size, 1, 1], source=buffers[0], result=buffers[1])
found = buffers[1].to_numpy().view(np.uint32).ravel()
want = source.reshape(-1, 64).cumsum(1, dtype=np.uint32).ravel()
assert (found == want).all(), f"{(found != want).sum()} prefix sums differ"

module = slangpy.Module(device.load_module("kernels"))
x, y = random.standard_normal((2, 10_000)).astype(np.float32)
lengths = module.length_of(x, y, _result="numpy")
error = (np.abs(lengths - np.hypot(x, y)) / np.hypot(x, y)).max()
assert error < 1e-6, f"lengths are off by {error}"
print(f"{device.info.adapter_name}: {source.size} prefix sums are equal, {x.size} lengths within {error:.1e}")
