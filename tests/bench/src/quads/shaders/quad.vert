#version 460
// Computes a corner of a Gaussian's quad. The vertex's index selects the Gaussian in a buffer. One instance per quad
// would cost software rasterizers far more, since they set up each instance separately.

struct Splat {
    vec2 mean;         // in pixels
    vec2 major, minor; // standard deviations along the ellipse's axes, in pixels
    float radius;      // in standard deviations: the distance at which alpha reaches its floor
    float unused;
    vec4 color;        // with the opacity as alpha
};

layout(std430, set = 0, binding = 0) readonly buffer Splats { Splat splats[]; };
layout(push_constant) uniform Push { vec2 pixel; float floor_; }; // pixel size in normalised device coordinates

layout(location = 0) noperspective out vec2 offset;
layout(location = 1) flat out vec4 color;

const float ROOT = 0.8493218002880191; // sqrt(log2(e) / 2): the fragment's exponential has base 2

void main() {
    Splat splat = splats[gl_VertexIndex >> 2];
    vec2 corner = vec2(gl_VertexIndex & 1, (gl_VertexIndex >> 1) & 1) * 2.0 - 1.0;
    vec2 size = 2.0 / pixel;
    vec2 deviations, place;
    if (splat.radius * length(splat.major) > max(size.x, size.y)) {
        // The quad is far larger than the picture, so the whole picture is drawn in its place: with corners so far
        // away, some rasterizers interpolate badly.
        place = (corner * 0.5 + 0.5) * size;
        vec2 from = place - splat.mean;
        deviations = vec2(dot(from, splat.major) / dot(splat.major, splat.major),
                          dot(from, splat.minor) / dot(splat.minor, splat.minor));
    } else {
        deviations = corner * splat.radius;
        place = splat.mean + deviations.x * splat.major + deviations.y * splat.minor;
    }
    gl_Position = vec4(place * pixel - 1.0, 0.0, 1.0);
    offset = deviations * ROOT;
    color = splat.color;
}
