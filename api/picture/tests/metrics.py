#!/usr/bin/env python3
"""Computes PSNR and SSIM of the pairs in `metrics.rs` as other programs do, and prints its table.

    api/picture/tests/metrics.py

It needs numpy and scipy. The columns are

- PSNR: `20 * log10(1 / sqrt(mse))` of 3DGS's `utils/image_utils.py`, which is torchmetrics' with a range of 1;
- SSIM of 3DGS's `utils/loss_utils.py`: convolutions of 11x11 with a padding of 5 zeros, the mean over all pixels;
- SSIM of torchmetrics from version 1.4.2 on: the picture is reflected at its border, the mean over all pixels;
- SSIM of pytorch-msssim: the mean over the pixels whose window lies in the picture.

They are also held against those of these programs that are installed: torchmetrics, pytorch-msssim, and scikit-image, whose
`structural_similarity` is the last column.
"""

import numpy as np
from scipy.signal import convolve2d

COUNT = 20


def pair(index):
    """Two pictures of bytes. A linear congruential generator makes their noise."""
    width, height = 16 + 7 * index, 12 + 5 * index
    state = index + 1
    a = np.zeros((height, width, 3))
    b = np.zeros((height, width, 3))
    for y in range(height):
        for x in range(width):
            for c in range(3):
                state = (state * 1664525 + 1013904223) % 2**32
                noise = (state >> 24) - 128
                value = (x * (5 + c) + y * (3 + index) + (x * y) // 16) % 256
                a[y, x, c] = value
                b[y, x, c] = min(max(value + noise * (index + 1) // 32, 0), 255)
    return a / 255, b / 255


def window():
    x = np.arange(11) - 5
    weights = np.exp(-(x**2) / (2 * 1.5**2))
    weights /= weights.sum()
    return np.outer(weights, weights)


def ssim_map(a, b, beyond):
    """SSIM of a channel at each pixel; `beyond` is NumPy's mode for the 5 pixels beyond the border."""
    smooth = lambda plane: convolve2d(np.pad(plane, 5, mode=beyond), window(), mode="valid")
    mean_a, mean_b = smooth(a), smooth(b)
    variance_a, variance_b = smooth(a * a) - mean_a**2, smooth(b * b) - mean_b**2
    covariance = smooth(a * b) - mean_a * mean_b
    c1, c2 = 0.01**2, 0.03**2
    return ((2 * mean_a * mean_b + c1) * (2 * covariance + c2)) / (
        (mean_a**2 + mean_b**2 + c1) * (variance_a + variance_b + c2)
    )


def measures(a, b):
    psnr = 20 * np.log10(1 / np.sqrt(np.mean((a - b) ** 2)))
    maps = lambda beyond: np.stack([ssim_map(a[..., c], b[..., c], beyond) for c in range(3)])
    zeros = maps("constant")
    return psnr, zeros.mean(), maps("reflect").mean(), zeros[:, 5:-5, 5:-5].mean()


def check(a, b, found):
    """Holds measures against the programs that are installed."""
    checked = []
    try:
        from skimage.metrics import structural_similarity

        options = dict(gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1.0, channel_axis=-1)
        assert abs(structural_similarity(a, b, **options) - found[3]) < 1e-9
        checked.append("scikit-image")
    except ImportError:
        pass
    try:
        import torch
        from torchmetrics.functional.image import peak_signal_noise_ratio, structural_similarity_index_measure

        x, y = (torch.from_numpy(image).permute(2, 0, 1)[None].float() for image in (a, b))
        assert abs(float(peak_signal_noise_ratio(x, y, data_range=1.0)) - found[0]) < 1e-4
        assert abs(float(structural_similarity_index_measure(x, y, data_range=1.0)) - found[2]) < 1e-4
        checked.append("torchmetrics")
    except ImportError:
        pass
    try:
        import torch
        from pytorch_msssim import ssim

        x, y = (torch.from_numpy(image).permute(2, 0, 1)[None].float() for image in (a, b))
        assert abs(float(ssim(x, y, data_range=1.0)) - found[3]) < 1e-4
        checked.append("pytorch-msssim")
    except ImportError:
        pass
    return checked


if __name__ == "__main__":
    for index in range(COUNT):
        a, b = pair(index)
        found = measures(a, b)
        checked = check(a, b, found)
        print("    [" + ", ".join(f"{value:.9f}" for value in found) + "],")
    print("// also held against:", ", ".join(checked) or "nothing")
