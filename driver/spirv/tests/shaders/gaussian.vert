#version 450
// Fixed-function projection as a vertex shader: a pinhole camera and spherical harmonics of degree 3.

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 scale;
layout(location = 2) in vec4 rotation;
layout(location = 3) in float opacity;

layout(set = 0, binding = 0, std430) readonly buffer Harmonics {
    float harmonics[];
};

layout(push_constant) uniform Camera {
    vec4 rows[3];
    vec4 eye;
    vec2 focal;
    vec2 principal;
    vec2 size;
    vec2 depth;
};

layout(location = 1) out vec3 covariance;
layout(location = 3) out float splatOpacity;
layout(location = 4) out vec3 color;
layout(location = 6) out float key;
layout(location = 7) out vec4 unused;

vec3 coefficient(int k) {
    int at = 48 * gl_VertexIndex + 3 * k;
    return vec3(harmonics[at], harmonics[at + 1], harmonics[at + 2]);
}

vec3 evaluate(vec3 d) {
    float x = d.x, y = d.y, z = d.z;
    float xx = x * x, yy = y * y, zz = z * z;
    vec3 c = 0.28209479177387814 * coefficient(0);
    c += 0.4886025119029199 * (-y * coefficient(1) + z * coefficient(2) - x * coefficient(3));
    c += 1.0925484305920792 * x * y * coefficient(4);
    c += -1.0925484305920792 * y * z * coefficient(5);
    c += 0.31539156525252005 * (2.0 * zz - xx - yy) * coefficient(6);
    c += -1.0925484305920792 * x * z * coefficient(7);
    c += 0.5462742152960396 * (xx - yy) * coefficient(8);
    c += -0.5900435899266435 * y * (3.0 * xx - yy) * coefficient(9);
    c += 2.890611442640554 * x * y * z * coefficient(10);
    c += -0.4570457994644658 * y * (4.0 * zz - xx - yy) * coefficient(11);
    c += 0.3731763325901154 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy) * coefficient(12);
    c += -0.4570457994644658 * x * (4.0 * zz - xx - yy) * coefficient(13);
    c += 1.445305721320277 * z * (xx - yy) * coefficient(14);
    c += -0.5900435899266435 * x * (xx - 3.0 * yy) * coefficient(15);
    return c;
}

mat3 turned(vec4 q) {
    float w = q.x, x = q.y, y = q.z, z = q.w;
    return mat3(
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
        2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
        2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
}

void main() {
    vec3 offset = position - eye.xyz;
    vec3 t = vec3(dot(rows[0].xyz, offset), dot(rows[1].xyz, offset), dot(rows[2].xyz, offset));
    vec2 slope = t.xy / t.z;
    vec2 margin = 0.15 * size / focal;
    vec2 uv = clamp(slope, -principal / focal - margin, (size - principal) / focal + margin);
    mat3 axes = turned(normalize(rotation));
    vec3 m0 = (focal.x / t.z * (rows[0].xyz - uv.x * rows[2].xyz)) * axes * scale;
    vec3 m1 = (focal.y / t.z * (rows[1].xyz - uv.y * rows[2].xyz)) * axes * scale;
    covariance = vec3(dot(m0, m0), dot(m0, m1), dot(m1, m1));
    splatOpacity = opacity;
    color = max(vec3(0.5) + evaluate(normalize(offset)), 0.0);
    key = t.z;
    unused = vec4(1.0);
    // 2 mean / size - 1, times w.
    vec2 clip = (2.0 * focal * t.xy + (2.0 * principal - size) * t.z) / size;
    gl_Position = vec4(clip, depth.x * t.z + depth.y, t.z);
}
