"""A program of bazalt: a compute shader writes an image, which a triangle over the whole target shows, and a triangle of three colours
lies over it; each is held against its formula."""

import pathlib
import sys
import tempfile

import bazalt
import numpy as np

SIZE = 256
SHADERS = {
    "pattern.comp": """#version 450
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0, rgba8) uniform writeonly image2D image;
void main() {
    uvec2 at = gl_GlobalInvocationID.xy;
    imageStore(image, ivec2(at), vec4(at.x ^ at.y, at.x & at.y, at.x | at.y, 255) / 255.0);
}""",
    "whole.vert": """#version 450
layout(location = 0) out vec2 place;
void main() {
    place = vec2(gl_VertexIndex & 2, (gl_VertexIndex << 1) & 2);
    gl_Position = vec4(place * 2.0 - 1.0, 0.0, 1.0);
}""",
    "show.frag": """#version 450
layout(location = 0) in vec2 place;
layout(location = 0) out vec4 color;
layout(set = 0, binding = 0) uniform sampler2D image;
void main() { color = texture(image, place); }""",
    "triangle.vert": """#version 450
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 color;
layout(location = 0) out vec3 shade;
void main() { gl_Position = vec4(position, 1.0); shade = color; }""",
    "triangle.frag": """#version 450
layout(location = 0) in vec3 shade;
layout(location = 0) out vec4 color;
void main() { color = vec4(shade, 1.0); }""",
}
CORNERS = np.array([[-0.5, -0.5], [-0.5, 0.5], [0.5, -0.5]])
COLORS = np.eye(3)


def draw(folder: pathlib.Path) -> np.ndarray:
    stages = {".comp": bazalt.ShaderStage.COMPUTE, ".vert": bazalt.ShaderStage.VERTEX, ".frag": bazalt.ShaderStage.FRAGMENT}
    with bazalt.Context() as context:
        shaders = {}
        for name, text in SHADERS.items():
            (folder / name).write_text(text)
            shaders[name] = context.compile_shader(str(folder / name), stages[name[-5:]])
        target = context.create_render_target(SIZE, SIZE)
        pattern = context.compute_pipeline().shader(shaders["pattern.comp"]).storage_image(0).build()
        show = context.graphics_pipeline().vertex_shader(shaders["whole.vert"]).fragment_shader(shaders["show.frag"])
        show = show.texture(0, bazalt.ShaderStage.FRAGMENT).build(target)
        formats = [bazalt.VertexFormat.FLOAT3, bazalt.VertexFormat.FLOAT3]
        over = context.graphics_pipeline().vertex_shader(shaders["triangle.vert"]).fragment_shader(shaders["triangle.frag"])
        over = over.vertex_format(formats).build(target)
        corners = np.concatenate([CORNERS, np.zeros((3, 1)), COLORS], axis=1).ravel()
        vertices = context.create_buffer(corners.tolist(), bazalt.BufferUsage.VERTEX, bazalt.MemoryUsage.STATIC)
        image = context.create_image(SIZE, SIZE, bazalt.Format.RGBA8)
        pool = context.create_descriptor_pool()
        written, read = pool.allocate_set(pattern), pool.allocate_set(show)
        written.set_storage_image(0, image)
        read.set_image(0, image)
        graph = context.graph()
        groups = SIZE // 8
        graph.add_pass(name="pattern").bind_pipeline(pattern).bind_descriptor_set(written, pattern).dispatch(groups, groups)
        with graph.add_pass(target, clear_color=[0.0, 0.0, 0.0, 1.0]) as drawing:
            drawing.bind_pipeline(show).bind_descriptor_set(read, show).draw(3)
            drawing.bind_pipeline(over).bind_vertex_buffer(vertices).draw(3)
        context.submit(graph)
        return np.array(target.color[0].read())


with tempfile.TemporaryDirectory() as folder:
    found = draw(pathlib.Path(folder)).astype(int)
y, x = np.mgrid[0:SIZE, 0:SIZE]
pattern = np.stack([x ^ y, x & y, x | y, np.full_like(x, 255)], axis=-1)
centre = (np.stack([x, y], axis=-1) + 0.5) * 2 / SIZE - 1
second, third = centre[..., 1] + 0.5, centre[..., 0] + 0.5
weights = np.stack([1 - second - third, second, third], axis=-1)
inside = (weights > 0).all(axis=-1)
edge = np.abs(weights).min(axis=-1) < 1e-6
expected = np.where(inside[..., None], np.concatenate([255 * weights, np.full((SIZE, SIZE, 1), 255)], axis=-1), pattern)
apart = np.abs(found - expected)[~edge]
if found.shape != expected.shape or inside.sum() < 5000 or apart[~inside[~edge]].max() > 0 or apart.max() > 0.51:
    sys.exit(f"the picture is {apart.max()} of 255 from its formula")
print(f"a pattern of a compute shader equal, {inside.sum()} pixels of a triangle within {apart.max():.2f} of 255")
