#version 450
layout(local_size_x = 32) in;
struct Item { uint id; float weight[3]; mat2x3 m; };
layout(std430, set = 0, binding = 0) readonly buffer In { uint index[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Out { float outputs[]; };
layout(std140, row_major, set = 0, binding = 2) uniform Block { mat3x2 rows; layout(column_major) mat2 columns[2]; vec2 v[3]; };
layout(std430, set = 0, binding = 3) buffer Items { Item items[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    uint k = index[i];
    float table[12];
    for (int j = 0; j < 12; j++) table[j] = float(j * j);
    vec4 vector = vec4(1.0, 2.0, 3.0, 4.0);
    vector[k & 3u] = 9.0;
    mat3 matrix = mat3(1, 2, 3, 4, 5, 6, 7, 8, 9);
    matrix[k % 3u][(k + 1u) % 3u] += 0.5;
    bool flags[6] = bool[](true, false, true, true, false, false);
    flags[k % 6u] = !flags[k % 6u];
    uint set = 0u;
    for (int j = 0; j < 6; j++) set += flags[j] ? 1u << j : 0u;
    float r[10];
    r[0] = table[k % 12u];
    r[1] = vector[(k + 1u) & 3u] + dot(vector, vec4(1));
    r[2] = determinant(matrix);
    r[3] = rows[k % 3u].y;
    r[4] = columns[k & 1u][1][k >> 1 & 1u];
    r[5] = v[k % 3u].y;
    Item item = items[k % 4u];
    r[6] = item.weight[k % 3u] + float(item.id);
    r[7] = (item.m * vec2(1, 2)).z;
    r[8] = float(set);
    r[9] = (vec2(1, 10) * rows).z;
    items[4u + i].m = mat2x3(r[0], r[1], r[2], r[3], r[4], r[5]);
    items[4u + i].weight = float[](r[6], r[7], r[8]);
    items[4u + i].id = k;
    for (int j = 0; j < 10; j++) outputs[10u * i + uint(j)] = r[j];
}
