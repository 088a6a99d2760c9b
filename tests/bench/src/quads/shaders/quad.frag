#version 460
// The premultiplied colour and alpha of a Gaussian at a pixel.

layout(location = 0) noperspective in vec2 offset;
layout(location = 1) flat in vec4 color;
layout(location = 0) out vec4 added;
layout(push_constant) uniform Push { vec2 pixel; float floor_; };

void main() {
    float alpha = min(0.99, color.a * exp2(-dot(offset, offset)));
    if (alpha < floor_) discard;
    added = vec4(color.rgb * alpha, alpha);
}
