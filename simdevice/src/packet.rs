//! Packets: what the driver asks of the device. Plain data; everything a packet needs it holds by [`Arc`].

mod display;
pub mod draw;
mod transfer;

use crate::compute::Dispatch;
use crate::format::Format;
use crate::image::ImageView;
use crate::query::QueryPool;
pub use devmem::BufferRange;
use std::sync::Arc;
pub use transfer::{
    BlitImage, BufferCopyRegion, BufferImageRegion, ClearImage, CopyBuffer, CopyBufferImage,
    CopyImage, ImageBlitRegion, ImageCopyRegion, ResolveImage, SubresourceLayers, SubresourceRange,
};

/// One command for the [`CommandProcessor`](crate::CommandProcessor).
#[derive(Clone, Debug)]
pub enum Packet {
    /// Copies regions between two buffers.
    CopyBuffer(CopyBuffer),
    /// Copies regions of a buffer into an image.
    CopyBufferToImage(CopyBufferImage),
    /// Copies regions of an image into a buffer.
    CopyImageToBuffer(CopyBufferImage),
    /// Copies texels between images whose formats have equal texel sizes.
    CopyImage(CopyImage),
    /// Copies texels between images, scaling and converting them.
    BlitImage(BlitImage),
    /// Copies colour texels of several samples to texels of one.
    ResolveImage(ResolveImage),
    /// Fills a buffer range with a repeated 32-bit word.
    FillBuffer {
        /// The range; offset and size are multiples of four.
        target: BufferRange,
        /// The word, in the host's byte order.
        word: u32,
    },
    /// Writes bytes that travelled in the packet to a buffer range.
    UpdateBuffer {
        /// The range; as long as `data`.
        target: BufferRange,
        /// The bytes.
        data: Arc<[u8]>,
    },
    /// Clears subresources of an image outside a render pass.
    ClearImage(ClearImage),
    /// Starts a render pass: attachments are loaded or cleared tile by tile when the pass is flushed.
    BeginRendering(Box<Rendering>),
    /// Clears rectangles of the current pass's attachments, in submission order with its draws.
    ClearAttachments(ClearAttachments),
    /// Starts a sorted set of Gaussians.
    GaussianBegin(Box<GaussianBegin>),
    /// Adds Gaussians to the set.
    GaussianAppend(Box<GaussianAppend>),
    /// Adds the Gaussians that a vertex program projects, one for each vertex: see [`draw::gaussian`]. Of the draw's
    /// state only the first viewport counts, which may be upside down. Where keys are equal, they come after those that
    /// were added with attributes.
    GaussianAppendDraw(Box<draw::Draw>),
    /// Has a fragment program make the colours of the set's fragments.
    GaussianResolveShader(Box<draw::ResolveShader>),
    /// Ends the set: it is sorted, binned and becomes one draw of the current pass.
    GaussianResolve,
    /// Runs workgroups of a compute program.
    Dispatch(Box<Dispatch>),
    /// Draws points, lines or triangles in the current pass.
    Draw(Box<draw::Draw>),
    /// Makes everything before visible to everything after; flushes a pass's bins if it is inside one.
    Barrier,
    /// Ends the render pass: its bins are rendered and its attachments stored.
    EndRendering,
    /// Starts query `index` of `pool`.
    BeginQuery {
        /// The pool.
        pool: Arc<QueryPool>,
        /// The query's index in it.
        index: u32,
    },
    /// Ends query `index` of `pool` and makes its result available.
    EndQuery {
        /// The pool.
        pool: Arc<QueryPool>,
        /// The query's index in it.
        index: u32,
    },
    /// Makes `count` queries from `first` on unavailable.
    ResetQueries {
        /// The pool.
        pool: Arc<QueryPool>,
        /// The first query.
        first: u32,
        /// How many.
        count: u32,
    },
    /// Writes the host's monotonic time in nanoseconds once everything before has finished.
    WriteTimestamp {
        /// The pool.
        pool: Arc<QueryPool>,
        /// The query's index in it.
        index: u32,
    },
}

/// Which half of a depth and stencil image is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Aspect {
    /// Colour texels.
    Color,
    /// The depth component.
    Depth,
    /// The stencil component.
    Stencil,
}

/// A clear value, as bits: how they are read depends on the format cleared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClearValue {
    /// For normalised and floating-point colour formats.
    Float([f32; 4]),
    /// For signed integer colour formats.
    Int([i32; 4]),
    /// For unsigned integer colour formats.
    Uint([u32; 4]),
    /// For depth and stencil formats.
    DepthStencil {
        /// Depth, 0 to 1.
        depth: f32,
        /// Stencil.
        stencil: u32,
    },
}

/// A rectangle of framebuffer pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rect {
    /// The left edge in pixels.
    pub x: i32,
    /// The top edge in pixels.
    pub y: i32,
    /// The width in pixels.
    pub width: u32,
    /// The height in pixels.
    pub height: u32,
}

impl Rect {
    /// The pixels that lie in both, as an empty rectangle where there are none.
    pub fn intersect(self, other: Self) -> Self {
        let right = |r: &Self| i64::from(r.x) + i64::from(r.width);
        let bottom = |r: &Self| i64::from(r.y) + i64::from(r.height);
        let (x, y) = (self.x.max(other.x), self.y.max(other.y));
        let span = |end: i64, start: i32| (end - i64::from(start)).clamp(0, u32::MAX.into()) as u32;
        Self {
            x,
            y,
            width: span(right(&self).min(right(&other)), x),
            height: span(bottom(&self).min(bottom(&other)), y),
        }
    }

    /// Whether it holds no pixel.
    pub fn is_empty(self) -> bool {
        self.width == 0 || self.height == 0
    }
}

/// What a pass does with an attachment's contents when it begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoadOp {
    /// Reads them.
    Load,
    /// Replaces them.
    Clear(ClearValue),
    /// Leaves them undefined (the device leaves what was there).
    DontCare,
}

/// What a pass does with an attachment's contents when it ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreOp {
    /// Writes them to memory.
    Store,
    /// Drops them (they may be written all the same).
    DontCare,
    /// The attachment was not written.
    None,
}

/// How the samples of a texel become one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ResolveMode {
    /// The first sample. What integer and stencil attachments, which have no mean, are commonly resolved by.
    SampleZero,
    /// The mean of all samples, of what they mean rather than of their codes: sRGB is decoded first.
    Average,
    /// The least sample, component by component.
    Min,
    /// The greatest sample, component by component.
    Max,
}

/// An attachment of a pass.
#[derive(Clone, Debug)]
pub struct Attachment {
    /// What is rendered to.
    pub view: ImageView,
    /// What happens at the beginning.
    pub load: LoadOp,
    /// What happens at the end.
    pub store: StoreOp,
    /// Where the pass leaves one sample for each texel of its area when it ends, if anywhere: a view of an image of
    /// one sample, as large as `view`. What `store` says doesn't matter to it.
    pub resolve: Option<(ImageView, ResolveMode)>,
}

/// See [`Packet::BeginRendering`].
#[derive(Clone, Debug)]
pub struct Rendering {
    /// The pixels that the pass may touch.
    pub area: Rect,
    /// How many layers of each attachment are rendered.
    pub layer_count: u32,
    /// Colour attachments by location; unused ones are `None`.
    pub color: Vec<Option<Attachment>>,
    /// The depth attachment.
    pub depth: Option<Attachment>,
    /// The stencil attachment.
    pub stencil: Option<Attachment>,
}

/// See [`Packet::ClearAttachments`].
#[derive(Clone, Debug)]
pub struct ClearAttachments {
    /// What is cleared to which value.
    pub clears: Vec<AttachmentClear>,
    /// Where, in framebuffer pixels and layers (first, count).
    pub rects: Vec<(Rect, u32, u32)>,
}

/// One attachment's clear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AttachmentClear {
    /// Colour attachment number `index`.
    Color {
        /// The attachment's index.
        index: usize,
        /// Its new value.
        value: ClearValue,
    },
    /// The depth attachment.
    Depth(f32),
    /// The stencil attachment.
    Stencil(u32),
}

/// The viewport transform, in framebuffer pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewport {
    /// The left edge.
    pub x: f32,
    /// The top edge.
    pub y: f32,
    /// The width.
    pub width: f32,
    /// The height.
    pub height: f32,
    /// The depth that 0 maps to.
    pub min_depth: f32,
    /// The depth that 1 maps to.
    pub max_depth: f32,
}

/// How a Gaussian draw's camera projects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CameraModel {
    /// Perspective with a principal point anywhere.
    Pinhole,
    /// Parallel: focal lengths are pixels per unit of length.
    Orthographic,
    /// Equidistant: focal lengths are pixels per radian from the axis.
    Fisheye,
    /// Longitude and latitude: focal lengths are pixels per radian. Pictures repeat after a period of a whole turn.
    Equirectangular,
}

/// The camera of a Gaussian draw: +x right, +y down, +z forward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// How it projects.
    pub model: CameraModel,
    /// World to camera, row-major.
    pub rotation: [f32; 9],
    /// The eye in world units; double, so that scenes far from the origin lose nothing.
    pub eye: [f64; 3],
    /// Focal lengths in pixels.
    pub focal_length: [f32; 2],
    /// The principal point in pixels from the viewport's corner.
    pub principal_point: [f32; 2],
    /// Gaussians must lie beyond this depth variable, in world units; greater than 0 unless the camera is orthographic.
    pub near_plane: f32,
    /// Gaussians must lie before this depth, in world units; may be infinite.
    pub far_plane: f32,
    /// Fragment depth is `c0 + c1 / z`, or `c0 + c1 z` for an orthographic camera, with the depth variable z.
    pub depth_coefficients: [f32; 2],
}

impl Default for Camera {
    /// At the origin, with focal lengths of one pixel, 3DGS's planes and a depth of 0.
    fn default() -> Self {
        Self {
            model: CameraModel::Pinhole,
            rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            eye: [0.0; 3],
            focal_length: [1.0; 2],
            principal_point: [0.0; 2],
            near_plane: 0.2,
            far_plane: f32::INFINITY,
            depth_coefficients: [0.0; 2],
        }
    }
}

/// What Gaussians are sorted by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GaussianOrder {
    /// The centre's depth variable: camera-space z, or the distance for a fisheye and a panorama.
    ViewDepth,
    /// The centre's distance from the eye.
    RadialDistance,
    /// Nothing: the order of the draw.
    Primitive,
    /// At each pixel, the depth at which the Gaussian is greatest on the pixel's ray.
    PerPixel,
}

/// What a Gaussian is in space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GaussianGeometry {
    /// A volume with three standard deviations, whose picture is approximated by an ellipse's.
    Volume,
    /// A flat disc with two, whose picture is exact. Not for fisheyes.
    Surfel,
}

/// The rasterizer's arithmetic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GaussianPrecision {
    /// binary32, or better.
    Float32,
    /// Every operation of a processing element is rounded to binary16. Only for volumes, and not in the per-pixel order.
    Float16,
}

/// How a Gaussian in space becomes one in the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum GaussianLinearization {
    /// By the camera's Jacobian at the mean.
    #[default]
    Jacobian,
    /// By the mean and the covariance of seven points, where a camera sees all of them.
    Unscented,
}

/// What Gaussians may be drawn the cheaper for. Both are permissions: what has no use for one is exact. By default
/// nothing may be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GaussianApproximation {
    /// The greatest relative error of the exponential that alpha is made of, 0 to 1. Whether alpha reaches its floor is
    /// decided without it.
    pub exponential_error: f32,
    /// What the contributions that are left out at a pixel may add up to, 0 to 1: the transmittance in front of each,
    /// times its alpha.
    pub contribution_budget: f32,
}

/// The state of a Gaussian draw that its pipeline fixes. See the extension for each value's meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct GaussianState {
    /// The spherical harmonics degree drawn, 0 to 3.
    pub sh_degree: u32,
    /// How they are projected.
    pub linearization: GaussianLinearization,
    /// The rasterizer's arithmetic.
    pub precision: GaussianPrecision,
    /// What the Gaussians are.
    pub geometry: GaussianGeometry,
    /// What the Gaussians are sorted by.
    pub order: GaussianOrder,
    /// Whether opacity is scaled by the ratio of determinants, so that the low-pass filter conserves energy.
    pub opacity_compensated: bool,
    /// Added to both diagonal elements of the screen-space covariance, in px^2.
    pub low_pass_variance: f32,
    /// The least alpha that contributes.
    pub alpha_floor: f32,
    /// The greatest alpha.
    pub alpha_ceiling: f32,
    /// A pixel is finished before its transmittance would fall below this.
    pub transmittance_floor: f32,
    /// How far pixels may be from all that.
    pub approximation: GaussianApproximation,
    /// The samples that may be covered.
    pub sample_mask: u32,
    /// Depth and stencil. Gaussians face the front.
    pub depth_stencil: draw::DepthStencil,
    /// The logic operation, if enabled; it then replaces blending.
    pub logic_op: Option<draw::LogicOp>,
    /// Blending and write masks, one per colour attachment. Only the first attachment is written.
    pub blend: Vec<BlendState>,
    /// The constants of the constant blend factors.
    pub blend_constants: [f32; 4],
}

impl Default for GaussianState {
    /// The defaults of 3DGS, degree 0; nothing is tested, and the fragment replaces what the attachment holds.
    fn default() -> Self {
        Self {
            sh_degree: 0,
            linearization: GaussianLinearization::Jacobian,
            precision: GaussianPrecision::Float32,
            geometry: GaussianGeometry::Volume,
            order: GaussianOrder::ViewDepth,
            opacity_compensated: false,
            low_pass_variance: 0.3,
            alpha_floor: 1.0 / 255.0,
            alpha_ceiling: 0.99,
            transmittance_floor: 1e-4,
            approximation: GaussianApproximation::default(),
            sample_mask: u32::MAX,
            depth_stencil: draw::DepthStencil::default(),
            logic_op: None,
            blend: Vec::new(),
            blend_constants: [0.0; 4],
        }
    }
}

/// A factor of the blend equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are Vulkan's")]
pub enum BlendFactor {
    Zero,
    One,
    SrcColor,
    OneMinusSrcColor,
    DstColor,
    OneMinusDstColor,
    SrcAlpha,
    OneMinusSrcAlpha,
    DstAlpha,
    OneMinusDstAlpha,
    ConstantColor,
    OneMinusConstantColor,
    ConstantAlpha,
    OneMinusConstantAlpha,
    SrcAlphaSaturate,
    Src1Color,
    OneMinusSrc1Color,
    Src1Alpha,
    OneMinusSrc1Alpha,
}

/// The operation of the blend equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are Vulkan's")]
pub enum BlendOp {
    Add,
    Subtract,
    ReverseSubtract,
    Min,
    Max,
}

/// One half (colour or alpha) of the blend equation: `op(source * s, destination * d)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BlendEquation {
    /// The source's factor.
    pub source: BlendFactor,
    /// The destination's factor.
    pub destination: BlendFactor,
    /// The operation.
    pub op: BlendOp,
}

/// The blending of one colour attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BlendState {
    /// The colour and alpha equations; `None` replaces the destination.
    pub equations: Option<(BlendEquation, BlendEquation)>,
    /// Bits 0 to 3 enable writes to R, G, B and A.
    pub write_mask: u8,
}

/// See [`Packet::GaussianBegin`].
#[derive(Clone, Debug)]
pub struct GaussianBegin {
    /// What the pipeline fixes.
    pub state: Arc<GaussianState>,
    /// The camera, which means nothing to what a vertex program projects.
    pub camera: Camera,
    /// The viewport; its width and height are the W and H of the projection.
    pub viewport: Viewport,
    /// Pixels outside are not touched.
    pub scissor: Rect,
}

/// Where one vertex attribute is read from. An element outside `buffer` reads as zero.
#[derive(Clone, Debug)]
pub struct AttributeStream {
    /// The vertex buffer, from the bound offset on.
    pub buffer: BufferRange,
    /// Bytes from one vertex to the next.
    pub stride: u32,
    /// Bytes from the vertex's start to the attribute.
    pub offset: u32,
    /// How it is stored.
    pub format: Format,
    /// Read by instance (advancing every `divisor` instances; 0: never) instead of by vertex.
    pub instance_divisor: Option<u32>,
}

/// The vertex attributes of fixed-function projection.
#[derive(Clone, Debug)]
pub struct GaussianAttributes {
    /// The mean in world units: x, y, z.
    pub position: AttributeStream,
    /// Standard deviations in world units along the rotated axes: x, y, z.
    pub scale: AttributeStream,
    /// The quaternion w, x, y, z; it need not be normalised.
    pub rotation: AttributeStream,
    /// Opacity.
    pub opacity: AttributeStream,
    /// `(degree + 1)^2` spherical harmonics coefficients of red, green and blue.
    pub spherical_harmonics: Vec<AttributeStream>,
    /// What is done to them, usually by instance.
    pub model: ModelAttributes,
}

/// The vertex attributes that place a copy of Gaussians in the world.
#[derive(Clone, Debug, Default)]
pub struct ModelAttributes {
    /// The rows of a 3x4 matrix from the Gaussians' space to the world, 4 components each; the identity without it.
    pub matrix: Option<Box<[AttributeStream; 3]>>,
    /// A factor of the opacity; 1 without it.
    pub opacity: Option<AttributeStream>,
}

impl ModelAttributes {
    /// Whether there is anything to be done.
    pub fn is_some(&self) -> bool {
        self.matrix.is_some() || self.opacity.is_some()
    }
}

/// An index buffer.
#[derive(Clone, Debug)]
pub struct IndexStream {
    /// The indices, from the bound offset on.
    pub buffer: BufferRange,
    /// Bytes per index: 1, 2 or 4.
    pub index_size: u32,
    /// Added to every index.
    pub vertex_offset: i32,
}

/// See [`Packet::GaussianAppend`].
#[derive(Clone, Debug)]
pub struct GaussianAppend {
    /// Where the Gaussians are.
    pub attributes: GaussianAttributes,
    /// The index buffer that picks them; without one they are consecutive.
    pub indices: Option<IndexStream>,
    /// The first vertex, or the first index.
    pub first: u32,
    /// How many vertices or indices.
    pub count: u32,
    /// The first instance.
    pub first_instance: u32,
    /// How many instances.
    pub instance_count: u32,
}
