#version 450
// Hands on what Gaussians accumulated at a pixel, and their expected and median depth.
layout(location = 0) in vec4 accumulated;
layout(location = 1) in vec2 depth;
layout(location = 0) out vec4 color;
layout(location = 1) out vec2 depths;
void main() {
    color = accumulated;
    depths = depth;
}
