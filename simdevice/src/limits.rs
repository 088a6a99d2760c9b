//! Sizes that bound what the device takes.

/// The side in pixels of the tiles that hold Gaussian lists, as in the paper.
pub const TILE_SIZE: u32 = 16;

/// The greatest side of a macro-tile in pixels.
pub const MAX_MACRO_TILE_SIZE: u32 = 128;

/// The most samples per pixel; the other count is 1.
pub const MAX_SAMPLES: u32 = 4;

/// The most colour attachments of a draw.
pub const MAX_COLOR_ATTACHMENTS: usize = 8;

/// The most viewports of a draw.
pub const MAX_VIEWPORTS: usize = 16;

/// The most clip and cull distances together.
pub const MAX_CLIP_CULL_DISTANCES: usize = 8;

/// The greatest width and height of an attachment in pixels.
pub const MAX_FRAMEBUFFER_SIZE: u32 = 1 << 16;

/// Layers of a pass at most, where no attachment has fewer.
pub(crate) const MAX_FRAMEBUFFER_LAYERS: u32 = 2048;

/// The most invocations of a workgroup.
pub const MAX_WORKGROUP_INVOCATIONS: u32 = 1024;

/// Invocations of a subgroup of vertices or fragments.
pub const DRAW_SUBGROUP_SIZE: u32 = 32;

/// The most bytes of workgroup memory that a program should ask for.
pub const MAX_SHARED_BYTES: u32 = 64 << 10;

/// The greatest side of a point, in pixels.
pub const MAX_POINT_SIZE: f32 = 255.0;

/// The greatest width of a line, in pixels.
pub const MAX_LINE_WIDTH: f32 = 255.0;

/// The greatest magnitude of the sum of a sampler's and an instruction's bias.
pub const MAX_LOD_BIAS: f32 = 16.0;
