"""Kernels that numba-vulkan compiles, against numpy."""

import math
import sys

import numba_vulkan as nv
import numpy as np


@nv.jit
def mandelbrot(counts, width, height, most):
    i = nv.global_id(0)
    if i < counts.size:
        cx = (i % width) * 3.0 / width - 2.0
        cy = (i // width) * 2.0 / height - 1.0
        x = 0.0
        y = 0.0
        n = 0
        while n < most and x * x + y * y <= 4.0:
            x, y = x * x - y * y + cx, 2.0 * x * y + cy
            n += 1
        counts[i] = n


@nv.jit
def waves(found, at):
    i = nv.global_id(0)
    if i < at.size:
        found[i] = math.sin(at[i]) * math.exp(-at[i] * at[i]) + math.sqrt(abs(at[i]))


width, height, most = 128, 96, 200
counts = np.zeros(width * height, np.int32)
mandelbrot.forall(counts.size)(counts, width, height, most)
expected = np.zeros_like(counts)
places = np.arange(counts.size)
c = (places % width * 3.0 / width - 2.0) + 1j * (places // width * 2.0 / height - 1.0)
z = np.zeros_like(c)
inside = np.ones(counts.size, bool)
for _ in range(most):
    inside &= z.real * z.real + z.imag * z.imag <= 4.0
    expected[inside] += 1
    z[inside] = z[inside] * z[inside] + c[inside]
different = int((counts != expected).sum())

at = np.linspace(-3, 3, 10000).astype(np.float32)
found = np.zeros_like(at)
waves.forall(at.size)(found, at)
exact = at.astype(np.float64)
distance = float(np.abs(found - (np.sin(exact) * np.exp(-exact * exact) + np.sqrt(np.abs(exact)))).max())
print(f"{different} of {counts.size} counts of a Mandelbrot set differ, waves within {distance:.1e}")
# A count may turn where the square of the length is 4 but for the rounding.
sys.exit(different > 12 or not distance < 1e-6)
