"""taichi on Vulkan: a stencil, a histogram by atomics and a reduction, compared with numpy."""

import numpy as np
import taichi as ti

ti.init(arch=ti.vulkan, offline_cache=False)
assert ti.lang.impl.current_cfg().arch == ti.vulkan, "taichi doesn't use Vulkan"
SIZE, STEPS, BINS = 128, 50, 16
heat = ti.field(ti.f32, shape=(2, SIZE, SIZE))
bins = ti.field(ti.i32, shape=BINS)


@ti.kernel
def fill():
    for i, j in ti.ndrange(SIZE, SIZE):
        heat[0, i, j] = ti.sin(0.1 * i) * ti.cos(0.07 * j)


@ti.kernel
def diffuse(source: ti.i32):
    for i, j in ti.ndrange(SIZE, SIZE):
        around = 0.0
        for k in ti.static(range(4)):
            x, y = i + (1, -1, 0, 0)[k], j + (0, 0, 1, -1)[k]
            around += heat[source, ti.math.clamp(x, 0, SIZE - 1), ti.math.clamp(y, 0, SIZE - 1)]
        heat[1 - source, i, j] = 0.6 * heat[source, i, j] + 0.1 * around


@ti.kernel
def count(source: ti.i32) -> ti.f32:
    total = 0.0
    for i, j in ti.ndrange(SIZE, SIZE):
        value = heat[source, i, j]
        bins[ti.math.clamp(int(ti.floor((value + 1) * BINS / 2)), 0, BINS - 1)] += 1
        total += value * value
    return total


fill()
i, j = np.mgrid[0:SIZE, 0:SIZE].astype(np.float64)
want = np.sin(0.1 * i) * np.cos(0.07 * j)
for step in range(STEPS):
    diffuse(step % 2)
    edge = np.pad(want, 1, mode="edge")
    around = edge[2:, 1:-1] + edge[:-2, 1:-1] + edge[1:-1, 2:] + edge[1:-1, :-2]
    want = 0.6 * want + 0.1 * around
total = count(STEPS % 2)
found = heat.to_numpy()[STEPS % 2]
error = np.abs(found - want).max()
# Vulkan allows an error of 2^-11 for a sine or cosine.
assert error < 2e-3, f"a stencil is off by {error}"
histogram = np.bincount(np.clip(np.floor((found + 1) * BINS / 2).astype(int), 0, BINS - 1).ravel(), minlength=BINS)
assert np.abs(bins.to_numpy() - histogram).sum() <= 2, "a histogram differs"
relative = abs(total - (found.astype(np.float64) ** 2).sum()) / total
assert relative < 1e-4, f"a sum is off by {relative}"
print(f"{STEPS} steps of a stencil within {error:.1e}, a histogram of {SIZE * SIZE} values, a sum within {relative:.1e}")
