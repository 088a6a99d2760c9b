//! Limits of the device.

/// The side in pixels of the tiles that hold Gaussian lists, as in the paper.
pub const TILE_SIZE: u32 = 16;

/// The greatest side of a macro-tile in pixels.
pub const MAX_MACRO_TILE_SIZE: u32 = 128;

/// The most samples per pixel. A pixel has this many samples or one.
pub const MAX_SAMPLES: u32 = 4;

/// The most colour attachments of a draw.
pub const MAX_COLOR_ATTACHMENTS: usize = 8;

/// The most viewports of a draw.
pub const MAX_VIEWPORTS: usize = 16;

/// The most clip and cull distances of a vertex, both together.
pub const MAX_CLIP_CULL_DISTANCES: usize = 8;

/// The most buffers that transform feedback writes.
pub const MAX_TRANSFORM_FEEDBACK_BUFFERS: usize = 4;

/// The most streams of vertices that a geometry program emits.
pub const MAX_VERTEX_STREAMS: usize = 4;

/// The greatest width and height of an attachment in pixels.
pub const MAX_FRAMEBUFFER_SIZE: u32 = 1 << 16;

/// The most layers of a pass. Attachments with fewer layers lower the limit.
pub(crate) const MAX_FRAMEBUFFER_LAYERS: u32 = 2048;

/// The most invocations of a workgroup.
pub const MAX_WORKGROUP_INVOCATIONS: u32 = 1024;

/// The number of invocations in a subgroup of vertices or fragments.
pub const DRAW_SUBGROUP_SIZE: u32 = 32;

/// The most bytes of workgroup memory that a program should ask for.
pub const MAX_SHARED_BYTES: u32 = 64 << 10;

/// The greatest side of a point, in pixels.
pub const MAX_POINT_SIZE: f32 = 255.0;

/// The greatest width of a line, in pixels.
pub const MAX_LINE_WIDTH: f32 = 255.0;

/// The greatest magnitude of a sampler's LOD bias plus an instruction's bias.
pub const MAX_LOD_BIAS: f32 = 16.0;
