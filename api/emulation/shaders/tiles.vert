#version 460
// Two triangles over each tile that has a contribution. The viewport is the set's area. With a resolve shader what the set has made is
// named by attributes, since the push constants are the application's, and is passed on. There may be two triangles over each pixel, or
// one that is twice as large as the tile, in a larger viewport, so that no quad of pixels is parted.
#extension GL_GOOGLE_include_directive : require
#include "head.glsl"
#ifdef RESOLVED
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Pixels { vec4 at[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer Words { uint at[]; };
const uint TILE = 16u;
// Addresses of pixels and of the words of tiles; of what else a resolve shader reads of them, and of cameras; the area's origin and size;
// samples of a pixel that the set tells apart, the one that is shown, the covering, as src/made.rs has it, and the viewport's width and
// height << 16.
layout(location = 0) in uvec4 images;
layout(location = 1) in uvec4 inputs;
layout(location = 2) in uvec4 area;
layout(location = 3) in uvec4 choice;
// As src/resolve.rs reads them: the same, with the view and the tile in place of the last numbers.
layout(location = 0) flat out uvec4 passed_images;
layout(location = 1) flat out uvec4 passed_inputs;
layout(location = 2) flat out uvec4 passed_area;
layout(location = 3) flat out uvec4 passed_choice;
const uint PIXELS = 1u, TRIANGLE = 2u;
#else
#include "shown.glsl"
#endif
#ifdef VIEWS
#extension GL_EXT_multiview : require
#ifndef RESOLVED
// Drivers agree on it here; in fragment shaders some have another view's.
layout(location = 0) flat out uint view;
#endif
#endif

void main() {
#if defined(VIEWS) && defined(RESOLVED)
    uint view = gl_ViewIndex;
#elif defined(VIEWS)
    view = gl_ViewIndex;
#else
    const uint view = 0u;
#endif
#ifdef RESOLVED
    uvec2 area_size = area.zw, viewport = uvec2(choice.w & 0xffffu, choice.w >> 16);
    Words shown = Words(images.zw);
    uint covering = choice.z, vertices = covering == TRIANGLE ? 3u : 6u, side = covering == PIXELS ? 1u : TILE;
#else
    uvec2 area_size = push.area_size, viewport = area_size;
    Words shown = push.shown;
    const uint vertices = 6u, side = TILE;
#endif
    uvec2 tiles = (area_size + TILE - 1u) / TILE;
    uint part = gl_VertexIndex / vertices, corner = gl_VertexIndex % vertices;
    // 0 1 2, 2 1 3.
    corner = corner < 3u ? corner : corner == 3u ? 2u : corner == 4u ? 1u : 3u;
    uint tile = part / (side == TILE ? 1u : TILE * TILE);
    uvec2 place = uvec2(tile % tiles.x, tile / tiles.x) * TILE, beside = uvec2(corner & 1u, corner >> 1) * side;
    bool is_shown = shown.at[view * tiles.x * tiles.y + tile] != 0u;
#ifdef RESOLVED
    passed_images = images;
    passed_inputs = inputs;
    passed_area = area;
    passed_choice = uvec4(choice.xy, view, view * tiles.x * tiles.y + tile);
    if (covering == PIXELS) {
        place += uvec2(part % TILE, part / TILE % TILE);
        if (is_shown && all(lessThan(place, area_size))) {
            is_shown = Pixels(images.xy).at[(view * area_size.y + place.y) * area_size.x + place.x].w >= 0.0;
        } else {
            is_shown = false;
        }
    }
    if (covering == TRIANGLE) {
        beside *= 2u;
    }
#endif
    uvec2 at = place + (is_shown ? beside : uvec2(0u));
#ifdef RESOLVED
    at = covering == TRIANGLE ? at : min(at, area_size);
#else
    at = min(at, area_size);
#endif
    gl_Position = vec4(2.0 * vec2(at) / vec2(viewport) - 1.0, 0.0, 1.0);
}
