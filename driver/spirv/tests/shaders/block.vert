#version 450
layout(location = 0) in mat3 frame;
layout(location = 4, component = 1) in vec2 packed;
layout(location = 2) out Varyings { vec3 normal; flat int id; float many[2]; } varyings;
out gl_PerVertex { vec4 gl_Position; float gl_PointSize; float gl_ClipDistance[2]; };
void main() {
    varyings.normal = frame[gl_VertexIndex % 3];
    varyings.id = gl_VertexIndex;
    varyings.many[0] = packed.x;
    varyings.many[1] = packed.y;
    gl_Position = vec4(frame * vec3(1, 2, 3), 1);
    gl_ClipDistance[1] = packed.y;
}
