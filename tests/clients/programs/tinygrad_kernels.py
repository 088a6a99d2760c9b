"""Kernels of tinygrad against numpy."""

import sys

import numpy as np
from tinygrad import Device, Tensor

if Device.DEFAULT != "WEBGPU":
    print(f"tinygrad computes on {Device.DEFAULT}")
    sys.exit(1)

random = np.random.default_rng(1)
a = random.standard_normal((64, 96)).astype(np.float32)
b = random.standard_normal((96, 80)).astype(np.float32)
picture = random.standard_normal((1, 3, 32, 32)).astype(np.float32)
filters = random.standard_normal((4, 3, 3, 3)).astype(np.float32)
numbers = random.permutation(1000).astype(np.int32)


def distance(found: Tensor, expected: np.ndarray) -> float:
    return float(np.abs(found.numpy() - expected).max())


powers = np.exp(a.astype(np.float64) - a.max(1, keepdims=True))
windows = np.lib.stride_tricks.sliding_window_view(picture.astype(np.float64)[0], (3, 3), axis=(1, 2))
figures = {
    "product": (distance(Tensor(a) @ Tensor(b), a.astype(np.float64) @ b), 5e-5),
    "softmax": (distance(Tensor(a).softmax(), powers / powers.sum(1, keepdims=True)), 5e-7),
    "convolution": (distance(Tensor(picture).conv2d(Tensor(filters))[0], np.einsum("cyxij,ocij->oyx", windows, filters)), 5e-5),
    "running sum": (distance(Tensor(numbers).cumsum(0), np.cumsum(numbers)), 0),
    "sort": (distance(Tensor(numbers).sort(0)[0], np.arange(1000)), 0),
}
print(", ".join(f"{name} within {found:.1e}" if most else f"{name} equal" for name, (found, most) in figures.items()))
wrong = [f"{name}: {found} off" for name, (found, most) in figures.items() if not found <= most]
if wrong:
    print("; ".join(wrong))
    sys.exit(1)
