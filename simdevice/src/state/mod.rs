//! The state of draws, which pipelines and commands set.

pub mod gaussian;

use std::fmt;
use std::fmt::{Display, Formatter};

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
    /// The pixels that are in both rectangles. The result is empty if there are none.
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

    /// True if it contains no pixel.
    pub fn is_empty(self) -> bool {
        self.width == 0 || self.height == 0
    }
}

/// The function that turns the samples of a texel into one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ResolveMode {
    /// The first sample. It is common for integer and stencil attachments, which have no mean.
    SampleZero,
    /// The mean of the values of all samples. sRGB samples are decoded before, and their mean is encoded.
    Average,
    /// The least sample, component by component.
    Min,
    /// The greatest sample, component by component.
    Max,
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
    /// The depth that 0 is mapped to.
    pub min_depth: f32,
    /// The depth that 1 is mapped to.
    pub max_depth: f32,
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

/// One half (colour or alpha) of the blend equation: `op(source * s, destination * d)` with the factors `s` and `d`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BlendEquation {
    /// The source's factor.
    pub source: BlendFactor,
    /// The destination's factor.
    pub destination: BlendFactor,
    /// The operation.
    pub op: BlendOp,
}

/// The blend equations of colour and alpha.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BlendEquations {
    /// The equation of red, green and blue.
    pub color: BlendEquation,
    /// The equation of alpha.
    pub alpha: BlendEquation,
}

impl BlendEquations {
    /// The same equation for colour and alpha.
    pub const fn both(equation: BlendEquation) -> Self {
        Self { color: equation, alpha: equation }
    }
}

/// The blending of one colour attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BlendState {
    /// The equations; `None` replaces the destination.
    pub equations: Option<BlendEquations>,
    /// Bits 0 to 3 enable writes to R, G, B and A.
    pub write_mask: u8,
}

/// The assembly of vertices to primitives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are Vulkan's")]
pub enum Topology {
    PointList,
    LineList,
    LineStrip,
    TriangleList,
    TriangleStrip,
    TriangleFan,
    LineListWithAdjacency,
    LineStripWithAdjacency,
    TriangleListWithAdjacency,
    TriangleStripWithAdjacency,
    PatchList {
        /// The number of vertices of a patch.
        control_points: u32,
    },
}

/// The part of a polygon that is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are Vulkan's")]
pub enum PolygonMode {
    Fill,
    Line,
    Point,
}

/// The rasterization of lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LineMode {
    /// A rectangle, sample by sample.
    Rectangular,
    /// Pixels by the diamond-exit rule, each with all its samples.
    Bresenham,
    /// The pixels that the rectangle meets. Alpha is multiplied by the share of the pixel.
    Smooth,
}

/// The pattern of stippled lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct LineStipple {
    /// The number of units of length, or of pixels of a Bresenham line, for which each bit of the pattern is used.
    pub factor: u32,
    /// The bits, from the least significant one on. What has a 0 is not drawn.
    pub pattern: u16,
}

/// A comparison of a reference with the stored value: `reference op stored`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are Vulkan's")]
pub enum CompareOp {
    Never,
    Less,
    Equal,
    LessOrEqual,
    Greater,
    NotEqual,
    GreaterOrEqual,
    Always,
}

impl CompareOp {
    /// True if the comparison holds. A comparison with NaN is false, except for [`CompareOp::NotEqual`] and
    /// [`CompareOp::Always`].
    #[inline(always)]
    pub fn holds<T: PartialOrd>(self, reference: T, stored: T) -> bool {
        match self {
            Self::Never => false,
            Self::Less => reference < stored,
            Self::Equal => reference == stored,
            Self::LessOrEqual => reference <= stored,
            Self::Greater => reference > stored,
            Self::NotEqual => reference != stored,
            Self::GreaterOrEqual => reference >= stored,
            Self::Always => true,
        }
    }
}

/// The change of a stencil value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are Vulkan's")]
pub enum StencilOp {
    Keep,
    Zero,
    Replace,
    IncrementAndClamp,
    DecrementAndClamp,
    Invert,
    IncrementAndWrap,
    DecrementAndWrap,
}

/// The stencil test of one face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StencilFace {
    /// The operation if the stencil test fails.
    pub fail: StencilOp,
    /// The operation if the stencil and depth tests pass.
    pub pass: StencilOp,
    /// The operation if only the depth test fails.
    pub depth_fail: StencilOp,
    /// The comparison: `reference & compare_mask op stored & compare_mask`.
    pub compare: CompareOp,
    /// The bits that are compared.
    pub compare_mask: u8,
    /// The bits that are written.
    pub write_mask: u8,
    /// The reference value.
    pub reference: u8,
}

/// Depth and stencil state. By default nothing is tested.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DepthStencil {
    /// The depth test. Without one, every fragment passes and no depth is written.
    pub depth: Option<DepthTest>,
    /// The least and the greatest stored depth at which a fragment passes.
    pub bounds: Option<(f32, f32)>,
    /// The stencil tests of front and back faces.
    pub stencil: Option<[StencilFace; 2]>,
}

/// The depth test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DepthTest {
    /// The comparison: `fragment op stored`.
    pub compare: CompareOp,
    /// True if the depth of a fragment that passes is written.
    pub write: bool,
}

/// The unit of a constant depth bias, as Vulkan's `r`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthBiasUnit {
    /// The resolution of the depth format: the same for all depths of a fixed-point format, and of a floating-point
    /// format that of the greatest depth's exponent.
    Format {
        /// True if a fixed-point format's is exactly 2 to the power of minus its bits, and not a little more than twice
        /// that.
        is_exact: bool,
    },
    /// The resolution of a fixed-point format with as many bits; a floating-point format has 24.
    FixedPoint {
        /// As that of [`Format`](Self::Format).
        is_exact: bool,
    },
    /// 1.
    One,
}

impl DepthBiasUnit {
    /// The unit unless something else is asked for.
    pub const DEFAULT: Self = Self::Format { is_exact: false };
}

impl Default for DepthBiasUnit {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Depth bias.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthBias {
    /// The constant bias, in units of `unit`.
    pub constant: f32,
    /// The unit of the constant bias.
    pub unit: DepthBiasUnit,
    /// The greatest bias if positive, the least bias if negative; no limit if 0.
    pub clamp: f32,
    /// The factor of the polygon's greatest depth slope.
    pub slope: f32,
}

/// A logic operation of source s and destination d.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are Vulkan's")]
pub enum LogicOp {
    Clear,
    And,
    AndReverse,
    Copy,
    AndInverted,
    NoOp,
    Xor,
    Or,
    Nor,
    Equivalent,
    Invert,
    OrReverse,
    CopyInverted,
    OrInverted,
    Nand,
    Set,
}

/// The fixed-function state of a draw, both static and dynamic.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawState {
    /// The assembly of vertices to primitives.
    pub topology: Topology,
    /// True if the greatest index restarts the primitive.
    pub primitive_restart: bool,
    /// The viewports.
    pub viewports: Vec<Viewport>,
    /// The scissor rectangles, one for each viewport.
    pub scissors: Vec<Rect>,
    /// True if depth is clamped to the viewport's range, and primitives are not clipped at the near and far planes.
    pub depth_clamp: bool,
    /// True if depths of a floating-point attachment may be less than 0 or more than 1. Otherwise they are clamped.
    pub unrestricted_depth: bool,
    /// True if primitives are clipped at the near and far planes. `None` follows from `depth_clamp`.
    pub depth_clip: Option<bool>,
    /// True if clip space's depths are from -w, not from 0, to w.
    pub negative_one_to_one: bool,
    /// Nothing is rasterized.
    pub rasterizer_discard: bool,
    /// The part of polygons that is drawn.
    pub polygon_mode: PolygonMode,
    /// True if front faces are culled.
    pub cull_front: bool,
    /// True if back faces are culled.
    pub cull_back: bool,
    /// True if front faces are clockwise in the framebuffer, whose y points down; else they are counter-clockwise.
    pub front_clockwise: bool,
    /// The depth bias, if enabled.
    pub depth_bias: Option<DepthBias>,
    /// The width of lines in pixels.
    pub line_width: f32,
    /// The rasterization of lines.
    pub line_mode: LineMode,
    /// True if lines are stippled.
    pub stipples_lines: bool,
    /// The pattern, if lines are stippled.
    pub line_stipple: LineStipple,
    /// True if the provoking vertex is the last; else it is the first.
    pub provoking_last: bool,
    /// The vertex stream that is rasterized.
    pub rasterized_stream: u32,
    /// True if the origin of the domain of patches is the lower left, which exchanges the orders of vertices.
    pub lower_left_domain: bool,
    /// The samples per pixel of the pass: 1 or 4.
    pub samples: u32,
    /// The mask of samples that may be covered.
    pub sample_mask: u32,
    /// True if the fragment program runs once for each sample.
    pub sample_shading: bool,
    /// True if the alpha of a fragment determines its coverage.
    pub alpha_to_coverage: bool,
    /// True if alpha is replaced by 1 after coverage was determined.
    pub alpha_to_one: bool,
    /// The depth and stencil state.
    pub depth_stencil: DepthStencil,
    /// The logic operation, if enabled. It then replaces blending.
    pub logic_op: Option<LogicOp>,
    /// The blending and write masks, one per colour attachment.
    pub blend: Vec<BlendState>,
    /// The constants of the constant blend factors.
    pub blend_constants: [f32; 4],
    /// True if fragments read, as input attachments, what all primitives before theirs have left in the pixel.
    pub reads_attachments: bool,
}

impl DrawState {
    /// Filled primitives over a framebuffer of that many pixels with one sample each. Nothing is culled, tested, biased
    /// or blended, and front faces are clockwise. `blend` is empty, so that the caller must add a state for each
    /// attachment.
    pub fn new(topology: Topology, [width, height]: [u32; 2]) -> Self {
        Self {
            topology,
            primitive_restart: false,
            viewports: vec![Viewport {
                x: 0.0,
                y: 0.0,
                width: width as f32,
                height: height as f32,
                min_depth: 0.0,
                max_depth: 1.0,
            }],
            scissors: vec![Rect { x: 0, y: 0, width, height }],
            depth_clamp: false,
            unrestricted_depth: false,
            depth_clip: None,
            negative_one_to_one: false,
            rasterizer_discard: false,
            polygon_mode: PolygonMode::Fill,
            cull_front: false,
            cull_back: false,
            front_clockwise: true,
            depth_bias: None,
            line_width: 1.0,
            line_mode: LineMode::Rectangular,
            stipples_lines: false,
            line_stipple: LineStipple { factor: 1, pattern: u16::MAX },
            provoking_last: false,
            rasterized_stream: 0,
            lower_left_domain: false,
            samples: 1,
            sample_mask: u32::MAX,
            sample_shading: false,
            alpha_to_coverage: false,
            alpha_to_one: false,
            depth_stencil: DepthStencil { depth: None, bounds: None, stencil: None },
            logic_op: None,
            blend: Vec::new(),
            blend_constants: [0.0; 4],
            reads_attachments: false,
        }
    }
}

impl Display for Rect {
    /// Writes `widthxheight+x+y`.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { x, y, width, height } = self;
        write!(f, "{width}x{height}{x:+}{y:+}")
    }
}
