#version 460
// A corner of a Gaussian's quad. Gaussians are pulled from a buffer by the vertex's index: a quad an instance costs
// software rasterizers far more, since they set up each instance on its own.

struct Splat {
    vec2 mean;         // in pixels
    vec2 major, minor; // standard deviations along the ellipse's axes, in pixels
    float radius;      // in standard deviations: where alpha reaches its floor
    float unused;
    vec4 color;        // and opacity
};

layout(std430, set = 0, binding = 0) readonly buffer Splats { Splat splats[]; };
layout(push_constant) uniform Push { vec2 pixel; float floor_; }; // a pixel in normalised device coordinates

layout(location = 0) noperspective out vec2 offset;
layout(location = 1) flat out vec4 color;

const float ROOT = 0.8493218002880191; // sqrt(log2(e) / 2): the fragment's exponential has base 2

void main() {
    Splat splat = splats[gl_VertexIndex >> 2];
    vec2 corner = vec2(gl_VertexIndex & 1, (gl_VertexIndex >> 1) & 1) * 2.0 - 1.0;
    vec2 size = 2.0 / pixel;
    vec2 deviations, place;
    if (splat.radius * length(splat.major) > max(size.x, size.y)) {
        // Far larger than the picture, which stands in for it: its own corners are so far off that some rasterizers
        // interpolate badly between them.
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
