#version 450
// A resolve shader that writes what accumulated, multiplied by numbers of the application, to three attachments.

layout(location = 0) in vec4 accumulated;

layout(set = 0, binding = 0) uniform Tint { vec4 tint; };
layout(push_constant) uniform Fades { vec4 unused; vec4 fade; };

layout(location = 0) out vec4 first;
layout(location = 1) out vec4 second;
layout(location = 2) out vec4 third;

void main() {
    vec4 color = accumulated * fade.x;
    first = color;
    second = color;
    third = color * tint;
}
