"""Runs OpenGL 4.3 by moderngl: a compute shader, transform feedback of a geometry shader, a tessellated patch, and a
textured draw of instances. Compares each with numpy."""

import moderngl
import numpy as np

context = moderngl.create_context(standalone=True, backend="egl", require=430)
renderer = context.info["GL_RENDERER"]
assert "zink" in renderer, renderer

# A compute shader: sums of pairs.
values = np.random.default_rng(1).random(20_000, dtype="f4")
given, sums = context.buffer(values), context.buffer(reserve=4 * len(values) // 2)
kernel = context.compute_shader("""
    #version 430
    layout(local_size_x = 100) in;
    layout(std430, binding = 0) buffer Given { float given[]; };
    layout(std430, binding = 1) buffer Sums { float sums[]; };
    void main() {
        uint i = gl_GlobalInvocationID.x;
        sums[i] = given[2u * i] + given[2u * i + 1u];
    }""")
given.bind_to_storage_buffer(0)
sums.bind_to_storage_buffer(1)
kernel.run(len(values) // 200)
context.memory_barrier()
computed = np.frombuffer(sums.read(), "f4")
assert np.array_equal(computed, values[0::2] + values[1::2]), "the sums differ"

# Without a picture to draw to, OpenGL draws nothing.
target = context.simple_framebuffer((64, 64), 4, dtype="f1")
target.use()

# Transform feedback: a geometry shader makes a strip of two triangles of each point.
program = context.program(
    vertex_shader="""
        #version 330
        in vec2 place;
        void main() { gl_Position = vec4(place, 0.0, 1.0); }""",
    geometry_shader="""
        #version 330
        layout(points) in;
        layout(triangle_strip, max_vertices = 4) out;
        out vec2 corner;
        void main() {
            for (int i = 0; i < 4; i++) {
                corner = gl_in[0].gl_Position.xy + vec2(i & 1, i >> 1);
                EmitVertex();
            }
        }""",
    varyings=["corner"],
)
points = np.arange(2_000, dtype="f4").reshape(1_000, 2)
captured = context.buffer(reserve=1_000 * 6 * 8)
array = context.simple_vertex_array(program, context.buffer(points), "place")
array.transform(captured, moderngl.POINTS)
found = np.frombuffer(captured.read(), "f4").reshape(1_000, 6, 2)
corners = np.array([[0, 0], [1, 0], [0, 1], [1, 0], [1, 1], [0, 1]], "f4")
expected = points[:, None, :] + corners
# A triangle may begin with any of its vertices.
order = [np.sort(part.reshape(1_000, 2, 3, 2).view("c8").reshape(1_000, 2, 3)) for part in (found.copy(), expected.copy())]
assert np.array_equal(*order), "the captured triangles differ"

# A tessellated quad that covers the middle of the picture.
target.clear()
program = context.program(
    vertex_shader="#version 430\nvoid main() { gl_Position = vec4(0.0); }",
    tess_control_shader="""
        #version 430
        layout(vertices = 1) out;
        void main() {
            gl_TessLevelOuter = float[](5.0, 6.0, 7.0, 8.0);
            gl_TessLevelInner = float[](3.0, 9.0);
        }""",
    tess_evaluation_shader="""
        #version 430
        layout(quads, fractional_odd_spacing) in;
        out vec2 place;
        void main() {
            place = gl_TessCoord.xy;
            gl_Position = vec4(gl_TessCoord.xy - 0.5, 0.0, 1.0);
        }""",
    fragment_shader="""
        #version 430
        in vec2 place;
        out vec4 color;
        void main() { color = vec4(place, 1.0, 1.0); }""",
)
context.patch_vertices = 1
context.vertex_array(program, []).render(moderngl.PATCHES, vertices=1)
picture = np.frombuffer(target.read(components=4), "u1").reshape(64, 64, 4) / 255.0
middle = np.zeros((64, 64, 4))
ramp = (np.arange(32) + 0.5) / 32
middle[16:48, 16:48] = 1.0
middle[16:48, 16:48, 0] = ramp[None, :]
middle[16:48, 16:48, 1] = ramp[:, None]
tessellated = np.abs(picture - middle).max()
assert tessellated < 1.5 / 255, f"the patch differs by {tessellated}"

# Instances of a textured square, each in a cell of its own.
colors = np.random.default_rng(2).integers(0, 256, (4, 4, 4), dtype="u1")
texture = context.texture((4, 4), 4, colors)
texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
texture.use(0)
program = context.program(
    vertex_shader="""
        #version 330
        out vec2 place;
        void main() {
            vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
            vec2 cell = vec2(gl_InstanceID & 3, gl_InstanceID >> 2);
            place = (cell + 0.5) / 4.0;
            gl_Position = vec4((cell + corner) / 2.0 - 1.0, 0.0, 1.0);
        }""",
    fragment_shader="""
        #version 330
        uniform sampler2D colors;
        in vec2 place;
        out vec4 color;
        void main() { color = texture(colors, place); }""",
)
target.clear()
context.vertex_array(program, []).render(moderngl.TRIANGLE_STRIP, vertices=4, instances=16)
picture = np.frombuffer(target.read(components=4), "u1").reshape(64, 64, 4)
assert np.array_equal(picture, colors.repeat(16, 0).repeat(16, 1)), "the textured cells differ"

version = context.info["GL_VERSION"].split()[0]
print(f"OpenGL {version}: sums, captured triangles and texels equal, the patch within {tessellated * 255:.1f} of 255")
