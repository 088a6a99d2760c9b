// A sorted set of Gaussians, as src/set.rs writes it. Every array is reached by its address.

#include "counters.glsl"
#include "outcomes.glsl"

layout(buffer_reference, std430, buffer_reference_align = 8) buffer Couples { uvec2 at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) buffer Pixels { vec4 at[]; };
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Depths { vec2 at[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Floats { float at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) buffer Rows { uvec4 at[]; };

// The Gaussian as it is seen: lengths in pixels, the mean from the origin of the framebuffer.
struct Record {
    vec2 mean_x, mean_y;             // pairs
    vec2 f0, f1, f2;                 // pairs: alpha is opacity 2^-((f0 dx)^2 + (f1 dx + f2 dy)^2); of a surfel: see surfel.glsl
    float opacity, red, green, blue;
    uint tiles_y;                    // first | last << 16
    float slope, curve, half_height, reach, half_width; // the ellipse by rows: see tiles.glsl
    uint cut_y;                      // tiles of the cut-off, from the viewport's corner: first | end << 16
    float cut_radius;                // in x
    float unused0, unused1;
};
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Records { Record at[]; };

// The cut-off of a 2D Gaussian.
struct Rectangle {
    vec2 shift_x, shift_y;           // from the mean to the filter's middle; pairs
    uint columns, rows;              // tiles, from the viewport's corner: first | end << 16
};
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Rectangles { Rectangle at[]; };

// VkGaussianCameraDataGAURAST; the eye is binary64.
struct Camera {
    uvec2 eye[3];
    int model, reserved;
    vec4 rotation[3];
    vec2 focal_length, principal_point, depth_coefficients;
    float near_plane, far_plane;
    vec4 unused;
};
layout(buffer_reference, std430, buffer_reference_align = 16) buffer Cameras { Camera at[]; };

// What is derived from the view's camera: the eye as sums of three binary32, and the limits of the slopes as pairs.
struct Derived {
    vec3 eye[3];
    vec2 limits[4];
    vec2 period;                 // of a panorama's picture in pixels; otherwise 0
};
layout(buffer_reference, std430, buffer_reference_align = 16) buffer DerivedCamera { Derived of; };

// A lens that distorts; numbers are pairs.
struct Lens {
    vec2 fold;                   // the square of the radius at which it folds
    vec2 steepness, scale;       // of a field of view
    vec2 widening;               // of a pinhole's bounds of slopes; 3.4e38 if there are none
    uint model;                  // see lens.glsl
    float radial[6], tangential[2], thin_prism[4];
    uint unused;
};
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Lenses { Lens at[]; };

// The outputs of a projecting shader: three vec4 for each vertex of each instance of each view.
struct Shaded {
    uvec2 outputs;               // their address; 0 without a projecting shader
    uint first_vertex, vertices; // of an instance
    uint instances, first_instance;
    uint capacity;               // the most outputs of a view
    uint unused;
    uint command[5];             // VkDraw(Indexed)IndirectCommand, as it is executed
    uint unused_;
};

// A table of numbers that decodings read; all are in bytes but the chunk's size.
struct Table {
    uvec2 address;
    uint bytes, stride;
    uint chunk_size;             // Gaussians
    uint is_binary64;
};

// The bytes that name numbers of the codebook of harmonics.
struct Codes {
    uvec2 address;
    uint bytes, stride, coefficient_stride, component_stride;
};

// The integers that name entries of a palette of harmonics.
struct Labels {
    uvec2 address;
    uint bytes, stride;
};

struct Draw {
    uvec2 indices;               // their address
    uint index_bytes;            // 0 without an index buffer
    uint index_count;            // indices beyond read as 0
    uint first, count;
    int vertex_offset;
    uint first_instance, instances;
    uint base;                   // Gaussians of the draws before
    uint indirect_index;         // position among the draws of the command
    uint is_indexed;
    uvec2 parameters;            // address of VkDraw(Indexed)IndirectCommand, or 0
    uvec2 draw_count;            // address of the number of draws, or 0
    uvec2 harmonics;             // address of the buffer of harmonics
    uint harmonics_bytes, harmonics_format, harmonics_stride, harmonics_coefficient_stride;
    Shaded shaded;
    Table tables[5];             // see decoding.glsl
    Codes codes;
    Labels labels;
};
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Draws { Draw at[]; };

// A vertex buffer. Elements that do not lie within its bytes read as zeros.
struct Source {
    uvec2 address;
    uint bytes, stride;
    uint divisor;                // 0xffffffff: by vertex
    uint unused;
};
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Sources { Source at[]; };

struct Attribute {
    uint source, offset, format; // see attributes.glsl
};
// Places in the list of attributes.
const uint POSITION = 0u, SCALE = 1u, ROTATION = 2u, OPACITY = 3u, MATRIX = 4u, FACTOR = 7u, HARMONICS = 8u;

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Set {
    Words counters;
    Words keys, values, pair_keys, pair_values, sums;
    Words reached;               // the number of tiles that each Gaussian reaches
    Words before_each;           // and of those before it in their order, within its block
    Couples ranges;
    Records records;
    Pixels image;
    Words shown;                 // 1 for each tile, of each view, that has a contribution; 0 before
    Words feedback;
    Draws draws;
    Sources sources;
    Cameras cameras;
    DerivedCamera derived;
    Depths depths;               // of each Gaussian: as the attachment holds it, in steps if it has steps; and the depth variable
    Couples stored;              // of each sample: what it stored before, as `depths` has it, and the outcome of its own tests
    Floats medians;              // of each sample: the median depth
    Couples names;               // of each Gaussian: its vertex and its instance, where a resolve shader reads them
    Rows inputs;                 // of each sample: expected and median depth and depth variable; median and nearest Gaussian
    Pixels seen_by;              // the camera of each view, as a resolve shader reads it; or 0
    Lenses lenses;               // of each camera; or 0
    Rectangles rectangles;       // of each 2D Gaussian that has a cut-off
    uvec2 unused;
    ivec2 area_origin;           // pixels that the set may reach
    uvec2 area_size;
    vec4 viewport;               // x, y, width, height; not negative
    uvec2 tiles;
    uint reserve, pair_capacity;
    uint draw_count, source_count, camera_count, degree;
    uint order, compensated, cut_off, harmonics_step;
    float low_pass, alpha_floor, alpha_ceiling, transmittance_floor;
    float compensation_floor, cut_off_deviations;
    uint is_surfel, depth_compare;
    vec2 depth_range;            // of the viewport
    uint depth_steps;            // 2^n - 1 of an attachment of n bits; 0 of one of floats
    uint is_negative_one_to_one;
    vec2 sigma_distance;         // of sigma points, in standard deviations
    vec2 sigma_center, sigma_other; // weights in the covariance
    vec2 picture[4];             // where sigma points count, from the viewport's corner: least and end of x, of y
    uint must_count;             // how many of the seven sigma points must count
    uint is_shaded;              // a vertex shader projects
    vec2 center[2], half_size;   // of the viewport: pairs; the height's half is negative if it is
    Attribute attributes[33];
    uint decodings;              // of attributes: see decoding.glsl
};

layout(push_constant) uniform Push {
    Set set;
    uint view;
    uint side;                   // the half of the pairs that is read
    uint plane;                  // the view's first pixel
} push;

// Models of cameras.
const int PINHOLE = 0, ORTHOGRAPHIC = 1, FISHEYE = 2, EQUIRECTANGULAR = 3;
// Orders.
const uint VIEW_DEPTH = 0u, RADIAL_DISTANCE = 1u, PRIMITIVE = 2u;
// Cut-offs.
const uint NO_CUT_OFF = 0u, ELLIPSE = 1u, TILE_SQUARE = 2u, TILE_RECTANGLE = 3u, TILE_RECTANGLE_COMPENSATED = 4u;

// Outcomes of the tests of a sample that no Gaussian takes part in: beyond the bounds, stencil failed, or neither.
const uint OUT_OF_BOUNDS = 0u, STENCIL_FAILED = 1u, GOES_ON = 2u;

// Width and height of a tile.
const uint TILE = 16u;
