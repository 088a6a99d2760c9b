#version 450
// Transform feedback: a variable, an array of blocks, of which each has its own buffer, and streams.
layout(points) in;
layout(points, max_vertices = 2) out;
struct Wide {
    int word;
    double number;
};
struct Nested {
    int before;
    Wide wide;
};
layout(stream = 1) out;
layout(location = 0, stream = 1, xfb_buffer = 1, xfb_stride = 20, xfb_offset = 4) out vec2 pair[2];
layout(location = 2, stream = 0, xfb_buffer = 2, xfb_stride = 16) out Block {
    layout(xfb_offset = 8) float second;
    float uncaptured;
    layout(xfb_offset = 0) int first;
} blocks[2];
layout(location = 8, stream = 2, xfb_buffer = 0, xfb_stride = 32, xfb_offset = 8) out Nested nested;
void main() {
    pair[0] = vec2(1.0);
    pair[1] = vec2(2.0);
    EmitStreamVertex(1);
    EndStreamPrimitive(1);
    blocks[0].second = 3.0;
    blocks[1].first = 4;
    blocks[1].uncaptured = 5.0;
    nested.before = 5;
    nested.wide.word = 6;
    nested.wide.number = 7.0lf;
    EmitStreamVertex(0);
    EndStreamPrimitive(0);
}
