"""IREE: functions compiled for Vulkan, compared with numpy."""

import iree.compiler as compiler
import iree.runtime as runtime
import numpy as np

SOURCE = """
func.func @product(%a: tensor<48x64xf32>, %b: tensor<64x80xf32>) -> tensor<48x80xf32> {
  %zero = arith.constant 0.0 : f32
  %empty = tensor.empty() : tensor<48x80xf32>
  %fill = linalg.fill ins(%zero : f32) outs(%empty : tensor<48x80xf32>) -> tensor<48x80xf32>
  %result = linalg.matmul ins(%a, %b : tensor<48x64xf32>, tensor<64x80xf32>)
      outs(%fill : tensor<48x80xf32>) -> tensor<48x80xf32>
  return %result : tensor<48x80xf32>
}
func.func @convolution(%a: tensor<1x18x18x8xf32>, %b: tensor<3x3x8x16xf32>) -> tensor<1x16x16x16xf32> {
  %zero = arith.constant 0.0 : f32
  %empty = tensor.empty() : tensor<1x16x16x16xf32>
  %fill = linalg.fill ins(%zero : f32) outs(%empty : tensor<1x16x16x16xf32>) -> tensor<1x16x16x16xf32>
  %result = linalg.conv_2d_nhwc_hwcf ins(%a, %b : tensor<1x18x18x8xf32>, tensor<3x3x8x16xf32>)
      outs(%fill : tensor<1x16x16x16xf32>) -> tensor<1x16x16x16xf32>
  return %result : tensor<1x16x16x16xf32>
}
func.func @softmax(%a: tensor<32x100xf32>) -> tensor<32x100xf32> {
  %empty = tensor.empty() : tensor<32x100xf32>
  %result = linalg.softmax dimension(1) ins(%a : tensor<32x100xf32>) outs(%empty : tensor<32x100xf32>)
      -> tensor<32x100xf32>
  return %result : tensor<32x100xf32>
}
"""
binary = compiler.compile_str(SOURCE, target_backends=["vulkan-spirv"])
module = runtime.load_vm_flatbuffer(binary, driver="vulkan")
random = np.random.default_rng(1)


def normal(*shape):
    return random.standard_normal(shape).astype(np.float32)


a, b = normal(48, 64), normal(64, 80)
image, kernel = normal(1, 18, 18, 8), normal(3, 3, 8, 16)
rows = normal(32, 100) * 5
windows = np.lib.stride_tricks.sliding_window_view(image.astype(np.float64)[0], (3, 3), axis=(0, 1))
exponentials = np.exp(rows.astype(np.float64) - rows.max(1, keepdims=True))
cases = {
    "product": (module.product(a, b), a.astype(np.float64) @ b),
    "convolution": (module.convolution(image, kernel), np.einsum("yxcij,ijcf->yxf", windows, kernel)[None]),
    "softmax": (module.softmax(rows), exponentials / exponentials.sum(1, keepdims=True)),
}
figures = []
for name, (found, want) in cases.items():
    error = np.abs(found.to_host() - want).max() / np.abs(want).max()
    assert error < 1e-5, f"{name}: off by {error}"
    figures.append(f"{name} within {error:.1e}")
print(", ".join(figures))
