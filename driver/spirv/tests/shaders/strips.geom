#version 450
layout(triangles_adjacency, invocations = 3) in;
layout(triangle_strip, max_vertices = 20) out;
layout(location = 0) in vec3 normal[];
layout(location = 1) flat in ivec2 numbers[];
layout(location = 0) out vec4 color;
layout(location = 2) out Block { float values[2]; } block;
void grow(int count) {
    for (int i = 0; i < count; i++) {
        int from = (i + gl_InvocationID) % 6;
        gl_Position = gl_in[from].gl_Position;
        color = vec4(normal[from], float(numbers[from].x));
        block.values[i & 1] = float(gl_PrimitiveIDIn);
        EmitVertex();
        if (i % 4 == 3) EndPrimitive();
    }
}
void main() {
    gl_Layer = gl_InvocationID;
    grow(numbers[0].y);
    if (normal[2].x > 0.0) grow(3);
}
