#version 460
// Two triangles over each tile that has a contribution. The viewport is the set's area.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#include "shown.glsl"
#ifdef VIEWS
#extension GL_EXT_multiview : require
// Drivers agree on it here; in fragment shaders some have another view's.
layout(location = 0) flat out uint view;
#endif

void main() {
#ifdef VIEWS
    view = gl_ViewIndex;
#else
    const uint view = 0u;
#endif
    uvec2 tiles = (push.area_size + TILE - 1u) / TILE;
    uint tile = gl_VertexIndex / 6u, corner = gl_VertexIndex % 6u;
    // 0 1 2, 2 1 3.
    corner = corner < 3u ? corner : corner == 3u ? 2u : corner == 4u ? 1u : 3u;
    uvec2 place = uvec2(tile % tiles.x, tile / tiles.x) * TILE, beside = uvec2(corner & 1u, corner >> 1) * TILE;
    bool is_shown = push.shown.at[view * tiles.x * tiles.y + tile] != 0u;
    uvec2 at = min(place + (is_shown ? beside : uvec2(0u)), push.area_size);
    gl_Position = vec4(2.0 * vec2(at) / vec2(push.area_size) - 1.0, 0.0, 1.0);
}
