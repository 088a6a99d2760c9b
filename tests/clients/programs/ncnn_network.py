"""ncnn: a network with convolutions, pooling and a dense layer, on Vulkan and on the processor."""

import os
import sys
import tempfile

import ncnn
import numpy as np

assert ncnn.get_gpu_count() == 1, f"{ncnn.get_gpu_count()} devices"
LAYERS = """7767517
9 9
Input data 0 1 data 0=32 1=32 2=3
Convolution conv1 1 1 data conv1 0=16 1=3 4=1 5=1 6=432 9=1
Pooling pool1 1 1 conv1 pool1 0=0 1=2 2=2
ConvolutionDepthWise depth 1 1 pool1 depth 0=16 1=3 4=1 5=1 6=144 7=16 9=1
Convolution conv2 1 1 depth conv2 0=32 1=1 5=1 6=512 9=1
Interp up 1 1 conv2 up 0=2 1=2.0 2=2.0
Pooling mean 1 1 up mean 0=1 4=1
InnerProduct dense 1 1 mean dense 0=10 1=1 2=320
Softmax softmax 1 1 dense softmax 0=0
"""
random = np.random.default_rng(1)
folder = tempfile.mkdtemp()
with open(os.path.join(folder, "net.param"), "w") as file:
    file.write(LAYERS)
with open(os.path.join(folder, "net.bin"), "wb") as file:
    # Each layer has a tag (0: binary32), its weights, and its bias; the dense layer is the same.
    for weights, bias in ((432, 16), (144, 16), (512, 32), (320, 10)):
        file.write(np.uint32(0).tobytes())
        file.write((random.standard_normal(weights) * 0.3).astype(np.float32).tobytes())
        file.write((random.standard_normal(bias) * 0.1).astype(np.float32).tobytes())
picture = random.standard_normal((3, 32, 32)).astype(np.float32)


def run(vulkan, half):
    net = ncnn.Net()
    net.opt.use_vulkan_compute = vulkan
    for option in ("use_fp16_packed", "use_fp16_storage", "use_fp16_arithmetic"):
        setattr(net.opt, option, half)
    assert net.load_param(os.path.join(folder, "net.param")) == 0
    assert net.load_model(os.path.join(folder, "net.bin")) == 0
    found = []
    for output in ("conv2", "softmax"):
        extractor = net.create_extractor()
        extractor.input("data", ncnn.Mat(picture))
        code, result = extractor.extract(output)
        assert code == 0, f"{output}: ncnn returns {code}"
        found.append(np.array(result))
    return found


want = run(False, False)
figures = []
for half, allowed in ((False, 1e-4), (True, 2e-2)):
    for name, a, b in zip(("features", "classes"), run(True, half), want):
        error = np.abs(a - b).max() / np.abs(b).max()
        assert a.shape == b.shape and error < allowed, f"{name}: off by {error}"
        figures.append(f"{error:.1e}")
print("against the processor, in binary32 and with binary16: " + ", ".join(figures))
sys.stdout.flush()
