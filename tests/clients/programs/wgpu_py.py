"""wgpu-py: a compute shader's numbers are those of numpy, and a triangle covers the pixels that it must."""

from pathlib import Path

import numpy as np
import wgpu
from wgpu.backends.wgpu_native.extras import set_instance_extras

programs = Path(__file__).parent
set_instance_extras(backends=["Vulkan"], flags=["AllowUnderlyingNoncompliantAdapter"])
adapter = wgpu.gpu.request_adapter_sync()
device = adapter.request_device_sync()

COUNT = 100_000
COLLATZ = (programs / "collatz.wgsl").read_text()
buffer = device.create_buffer_with_data(
    data=np.arange(1, COUNT + 1, dtype=np.uint32),
    usage=wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC,
)
pipeline = device.create_compute_pipeline(
    layout="auto", compute={"module": device.create_shader_module(code=COLLATZ), "entry_point": "main"}
)
group = device.create_bind_group(
    layout=pipeline.get_bind_group_layout(0), entries=[{"binding": 0, "resource": {"buffer": buffer}}]
)
encoder = device.create_command_encoder()
compute = encoder.begin_compute_pass()
compute.set_pipeline(pipeline)
compute.set_bind_group(0, group)
compute.dispatch_workgroups(-(-COUNT // 64))
compute.end()
device.queue.submit([encoder.finish()])
steps = np.frombuffer(device.queue.read_buffer(buffer), np.uint32)

want = np.zeros(COUNT, np.uint32)
value = np.arange(1, COUNT + 1, dtype=np.uint64)
while (value > 1).any():
    going = value > 1
    want[going] += 1
    value = np.where(going, np.where(value % 2 == 0, value // 2, 3 * value + 1), value)
assert (steps == want).all(), f"{(steps != want).sum()} of {COUNT} numbers differ"

SIZE = 256
TRIANGLE = (programs / "triangle.wgsl").read_text()
texture = device.create_texture(
    size=(SIZE, SIZE),
    format="rgba8unorm",
    usage=wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.COPY_SRC,
)
module = device.create_shader_module(code=TRIANGLE)
pipeline = device.create_render_pipeline(
    layout="auto",
    vertex={"module": module, "entry_point": "vs", "buffers": []},
    primitive={"topology": "triangle-list"},
    fragment={"module": module, "entry_point": "fs", "targets": [{"format": "rgba8unorm"}]},
)
encoder = device.create_command_encoder()
render = encoder.begin_render_pass(
    color_attachments=[
        {"view": texture.create_view(), "clear_value": (0, 0, 0, 0), "load_op": "clear", "store_op": "store"}
    ]
)
render.set_pipeline(pipeline)
render.draw(3)
render.end()
device.queue.submit([encoder.finish()])
bytes_read = device.queue.read_texture(
    {"texture": texture}, {"bytes_per_row": SIZE * 4, "rows_per_image": SIZE}, (SIZE, SIZE, 1)
)
pixels = np.frombuffer(bytes_read, np.uint8).reshape(SIZE, SIZE, 4)
# In pixels, the corners are (96, 160), (224, 160) and (96, 32): a pixel is covered if its centre is within.
y, x = np.mgrid[0:SIZE, 0:SIZE]
inside = (x >= 96) & (y < 160) & ((x + 0.5 - 96) + (160 - y - 0.5) < 128)
drawn = np.dstack([x, y, np.full_like(x, 51), np.full_like(x, 255)])
# A centre on the slanted edge belongs to the triangle or not, by the rule of that edge.
edge = (x >= 96) & (y < 160) & ((x + 0.5 - 96) + (160 - y - 0.5) == 128)
differ = (np.abs(pixels.astype(int) - np.where(inside[..., None], drawn, 0)) > 0).any(-1) & ~edge
assert not differ.any(), f"{differ.sum()} pixels of a triangle differ"
print(f"{adapter.info['device']}: {COUNT} numbers and {SIZE * SIZE} pixels are equal")
