//! The state of draws, which their pipelines and commands fix.

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

/// How vertices make primitives.
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
}

/// What of a polygon is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are Vulkan's")]
pub enum PolygonMode {
    Fill,
    Line,
    Point,
}

/// A comparison of a reference with what memory holds: `reference op stored`.
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
    /// Tells whether it holds. A comparison with NaN is false, but for [`CompareOp::NotEqual`] and
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

/// What becomes of a stencil value.
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
    /// When the stencil test fails.
    pub fail: StencilOp,
    /// When both tests pass.
    pub pass: StencilOp,
    /// When only the depth test fails.
    pub depth_fail: StencilOp,
    /// `reference & compare_mask op stored & compare_mask`.
    pub compare: CompareOp,
    /// The bits compared.
    pub compare_mask: u8,
    /// The bits written.
    pub write_mask: u8,
    /// The reference.
    pub reference: u8,
}

/// Depth and stencil state. By default nothing is tested.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DepthStencil {
    /// The depth test; `None` passes always and writes nothing.
    pub depth: Option<DepthTest>,
    /// The depth bounds that the stored depth must lie in.
    pub bounds: Option<(f32, f32)>,
    /// The stencil test of front and back faces.
    pub stencil: Option<[StencilFace; 2]>,
}

/// The depth test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DepthTest {
    /// `fragment op stored`.
    pub compare: CompareOp,
    /// Whether depth is written where it passes.
    pub write: bool,
}

/// Depth bias.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthBias {
    /// In units of the depth format's resolution.
    pub constant: f32,
    /// The greatest bias if positive, the least if negative; none if 0.
    pub clamp: f32,
    /// Times the polygon's greatest slope.
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

/// The fixed-function state of a draw, static and dynamic alike.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawState {
    /// How vertices make primitives.
    pub topology: Topology,
    /// Whether the greatest index restarts the primitive.
    pub primitive_restart: bool,
    /// The viewports.
    pub viewports: Vec<Viewport>,
    /// The scissors, one for each viewport.
    pub scissors: Vec<Rect>,
    /// Depth is clamped to the viewport's range, and primitives are not clipped at the near and far planes.
    pub depth_clamp: bool,
    /// Whether primitives are clipped at the near and far planes, if that doesn't follow from `depth_clamp`.
    pub depth_clip: Option<bool>,
    /// Whether clip space's depths are from -w, not from 0, to w.
    pub negative_one_to_one: bool,
    /// Nothing is rasterized.
    pub rasterizer_discard: bool,
    /// What of polygons is drawn.
    pub polygon_mode: PolygonMode,
    /// Whether front faces are culled.
    pub cull_front: bool,
    /// Whether back faces are culled.
    pub cull_back: bool,
    /// Whether front faces are clockwise in the framebuffer (y down); else they are counter-clockwise.
    pub front_clockwise: bool,
    /// Depth bias, if enabled.
    pub depth_bias: Option<DepthBias>,
    /// The width of lines in pixels.
    pub line_width: f32,
    /// Whether the provoking vertex is the last, not the first.
    pub provoking_last: bool,
    /// Samples per pixel of the pass: 1 or 4.
    pub samples: u32,
    /// The samples that may be covered.
    pub sample_mask: u32,
    /// Whether every sample is shaded for itself.
    pub sample_shading: bool,
    /// Alpha makes coverage.
    pub alpha_to_coverage: bool,
    /// Alpha becomes 1 after that.
    pub alpha_to_one: bool,
    /// Depth and stencil.
    pub depth_stencil: DepthStencil,
    /// The logic operation, if enabled; it then replaces blending.
    pub logic_op: Option<LogicOp>,
    /// Blending and write masks, one per colour attachment.
    pub blend: Vec<BlendState>,
    /// The constants of the constant blend factors.
    pub blend_constants: [f32; 4],
}

impl DrawState {
    /// Filled primitives over a framebuffer of that many pixels, one sample each: nothing is culled, tested, biased or
    /// blended, and front faces are clockwise. Attachments have no state yet.
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
            scissors: vec![Rect {
                x: 0,
                y: 0,
                width,
                height,
            }],
            depth_clamp: false,
            depth_clip: None,
            negative_one_to_one: false,
            rasterizer_discard: false,
            polygon_mode: PolygonMode::Fill,
            cull_front: false,
            cull_back: false,
            front_clockwise: true,
            depth_bias: None,
            line_width: 1.0,
            provoking_last: false,
            samples: 1,
            sample_mask: u32::MAX,
            sample_shading: false,
            alpha_to_coverage: false,
            alpha_to_one: false,
            depth_stencil: DepthStencil {
                depth: None,
                bounds: None,
                stencil: None,
            },
            logic_op: None,
            blend: Vec::new(),
            blend_constants: [0.0; 4],
        }
    }
}

impl Display for Rect {
    /// `widthxheight+x+y`.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self {
            x,
            y,
            width,
            height,
        } = self;
        write!(f, "{width}x{height}{x:+}{y:+}")
    }
}
