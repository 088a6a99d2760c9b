#version 450
layout(location = 0) in vec4 position;
layout(location = 1) in vec4 distances;
out gl_PerVertex {
    vec4 gl_Position;
    float gl_ClipDistance[2];
    float gl_CullDistance[1];
};
void main() {
    gl_Position = position;
    gl_ClipDistance[0] = distances.x;
    gl_ClipDistance[1] = distances.y;
    gl_CullDistance[0] = distances.z;
}
