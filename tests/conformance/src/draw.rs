//! A draw as plain data, from which the commands are recorded and the oracle computes its answer.

use ash::vk;
use gaurast::vk::{
    GaussianCameraDistortionGAURAST, GaussianCameraGAURAST, GaussianCutOffGAURAST as CutOff,
    PipelineGaussianFootprintStateCreateInfoGAURAST, PipelineGaussianStateCreateInfoGAURAST,
    PipelineGaussianUnscentedStateCreateInfoGAURAST,
};
use gaurast_oracle::oracle::error_model::PrecisionClass;
use gaurast_oracle::oracle::{OracleDepthFormat, OracleInstance, Rules};
use gaurast_oracle::scenes::{self, SceneBuffers};

/// The Gaussian state of a pipeline.
pub type State = PipelineGaussianStateCreateInfoGAURAST<'static>;

/// The pixels that Gaussians may reach.
pub type Footprint = PipelineGaussianFootprintStateCreateInfoGAURAST<'static>;

/// The sigma points of the unscented transform.
pub type Unscented = PipelineGaussianUnscentedStateCreateInfoGAURAST<'static>;

/// The distortion of a camera's lens.
pub type Distortion = GaussianCameraDistortionGAURAST<'static>;

/// A camera.
pub type Camera = GaussianCameraGAURAST<'static>;

/// Width and height of pictures, in pixels. Odd, so that tiles are cut.
pub const SIZE: [u32; 2] = [107, 83];

/// One render pass with Gaussian draws, and the initial contents of its attachments.
#[derive(Clone, Debug)]
pub struct Draw {
    /// Contents of the vertex buffers.
    pub scene: SceneBuffers,
    /// True if attributes are stored as binary16.
    pub half: bool,
    /// The pipeline's degree, at most that of the scene.
    pub degree: u32,
    /// The Gaussian state. Its degree and locations are set when the pipeline is created.
    pub state: State,
    /// `exponentialError` and `contributionBudget`, if that structure is chained.
    pub approximation: Option<[f32; 2]>,
    /// The footprint, if the structure is chained.
    pub footprint: Option<Footprint>,
    /// The sigma points, if the structure is chained.
    pub unscented: Option<Unscented>,
    /// The inputs that a resolve shader shows as colours, if there is one.
    pub shown: Option<Shown>,
    /// The camera.
    pub camera: Camera,
    /// The distortion of its lens, if the structure is chained.
    pub distortion: Option<Distortion>,
    /// True if the camera comes from a uniform buffer.
    pub camera_in_buffer: bool,
    /// Model matrices with opacity factors, and their input rate.
    pub instances: Option<(vk::VertexInputRate, Vec<OracleInstance>)>,
    /// The index buffer.
    pub indices: Vec<u32>,
    /// The recorded commands.
    pub calls: Vec<Call>,
    /// True if the calls are one set, or several that are separated by [`Call::EndSet`]; false if each call is a set.
    pub merged: bool,
    /// Width and height of the attachments, in pixels.
    pub size: [u32; 2],
    /// The viewport, if it is not the whole attachment.
    pub viewport: Option<vk::Viewport>,
    /// The scissor, if it is not the whole attachment.
    pub scissor: Option<vk::Rect2D>,
    /// The render area, if it is not the whole attachment.
    pub area: Option<vk::Rect2D>,
    /// The colour attachment's format, one of [`ColorFormat`]s.
    pub format: ColorFormat,
    /// Contents of the colour attachment before the draw.
    pub behind: [f32; 4],
    /// Blending of fragments.
    pub blend: Blend,
    /// Another blend equation in place of that.
    pub equation: Option<Equation>,
    /// Components that are written.
    pub write_mask: vk::ColorComponentFlags,
    /// Depth and stencil.
    pub depth: Option<Depth>,
    /// Number of samples per pixel.
    pub samples: u32,
    /// Mask of the samples of each 32 that are written.
    pub sample_mask: u32,
    /// The rules that the oracle follows: the text's, but for mistakes.
    pub rules: Rules,
}

/// Inputs of a resolve shader, which it writes as a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// The accumulated colour.
    Accumulated,
    /// The expected and the median depth, then 0 and 1.
    Depths,
    /// The expected and the median depth variable, then 0 and 1.
    LinearDepths,
    /// Vertex and instance of the median, and of the nearest.
    Gaussians,
    /// The vector of the camera at a location from 0 to 5.
    Camera(u32),
}

impl Shown {
    /// The number by which the shader knows it.
    pub(crate) fn number(self) -> u32 {
        match self {
            Self::Accumulated => 0,
            Self::Depths => 1,
            Self::LinearDepths => 2,
            Self::Gaussians => 3,
            Self::Camera(location) => 4 + location,
        }
    }
}

/// A command.
#[derive(Clone, Copy, Debug)]
pub enum Call {
    /// `vkCmdDraw`.
    Draw {
        /// The first vertex and their number.
        vertices: [u32; 2],
        /// The first instance and their number.
        instances: [u32; 2],
    },
    /// `vkCmdDrawIndexed` of one instance.
    Indexed {
        /// The first index and their number.
        indices: [u32; 2],
        /// The vertex offset, which is added to each index.
        offset: i32,
    },
    /// `vkCmdDrawIndirect` of one draw, whose parameters are in a buffer.
    Indirect {
        /// The first vertex and their number.
        vertices: [u32; 2],
    },
    /// The end of a set and the beginning of another one.
    EndSet,
}

/// The blending of fragments with the colour attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blend {
    /// `ONE`, `ONE_MINUS_SRC_ALPHA`.
    Over,
    /// Blending is off.
    Replace,
    /// `ONE`, `ONE`.
    Add,
    /// `ONE_MINUS_DST_ALPHA`, `ONE`: the fragments are behind the contents.
    Under,
}

/// A blend equation: factors of the fragment and of the contents, and their operation, for colours and for alpha.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equation {
    /// The factors and the operation of red, green and blue.
    pub color: ([vk::BlendFactor; 2], vk::BlendOp),
    /// Those of alpha.
    pub alpha: ([vk::BlendFactor; 2], vk::BlendOp),
    /// The constants of constant factors.
    pub constants: [f32; 4],
}

/// A colour attachment's format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorFormat {
    /// `R32G32B32A32_SFLOAT`.
    Float32,
    /// `R16G16B16A16_SFLOAT`.
    Float16,
    /// `R8G8B8A8_UNORM`.
    Unorm8,
}

impl ColorFormat {
    /// The Vulkan format.
    pub fn raw(self) -> vk::Format {
        match self {
            Self::Float32 => vk::Format::R32G32B32A32_SFLOAT,
            Self::Float16 => vk::Format::R16G16B16A16_SFLOAT,
            Self::Unorm8 => vk::Format::R8G8B8A8_UNORM,
        }
    }

    /// The greatest rounding error of storing a number of at most `greatest`: half a step of the format.
    pub(crate) fn rounding(self, greatest: f64) -> f64 {
        match self {
            Self::Float32 => 0.0,
            Self::Float16 => greatest.max(1.0) / 2048.0,
            Self::Unorm8 => 0.501 / 255.0,
        }
    }

    /// The possible error of a blend: a step of integers, which devices blend as such.
    pub(crate) fn blending(self, greatest: f64) -> f64 {
        match self {
            Self::Unorm8 => 1.0 / 255.0,
            Self::Float32 | Self::Float16 => self.rounding(greatest),
        }
    }
}

/// A depth and stencil attachment: its format, its initial contents, and the tests.
#[derive(Clone, Copy, Debug)]
pub struct Depth {
    /// `D16_UNORM`, `D32_SFLOAT`, `X8_D24_UNORM_PACK32` or `D32_SFLOAT_S8_UINT`.
    pub format: vk::Format,
    /// The comparison and whether depths are written, if there is a test.
    pub test: Option<(vk::CompareOp, bool)>,
    /// The least and the greatest stored depth, if they are tested.
    pub bounds: Option<[f32; 2]>,
    /// The stencil test.
    pub stencil: Option<vk::StencilOpState>,
    /// The initial contents: stripes with the depths of these depth variables, and stencils 0 to 7.
    pub stripes: [f32; 6],
}

impl Depth {
    pub(crate) fn oracle_format(&self) -> OracleDepthFormat {
        match self.format {
            vk::Format::D16_UNORM => OracleDepthFormat::Unorm(16),
            vk::Format::X8_D24_UNORM_PACK32 => OracleDepthFormat::Unorm(24),
            _ => OracleDepthFormat::Float,
        }
    }

    pub(crate) fn has_stencil(&self) -> bool {
        self.format == vk::Format::D32_SFLOAT_S8_UINT
    }

    /// The number of bytes of a depth.
    pub(crate) fn texel(&self) -> u64 {
        if self.format == vk::Format::D16_UNORM { 2 } else { 4 }
    }
}

impl Draw {
    /// The same draw, held to a class of precision.
    #[must_use]
    pub fn held_to(mut self, precision: PrecisionClass) -> Self {
        self.rules.precision = precision;
        self
    }

    /// A draw of the whole scene in the default state over an empty picture, with the front camera.
    pub fn new(scene: SceneBuffers) -> Self {
        let count = scene.positions.len() as u32;
        Self {
            half: false,
            degree: scene.degree,
            scene,
            state: State::default(),
            approximation: None,
            footprint: None,
            unscented: None,
            shown: None,
            camera: scenes::camera(SIZE[0], SIZE[1]).to_vulkan(),
            distortion: None,
            camera_in_buffer: false,
            instances: None,
            indices: Vec::new(),
            calls: vec![Call::Draw { vertices: [0, count], instances: [0, 1] }],
            merged: false,
            size: SIZE,
            viewport: None,
            scissor: None,
            area: None,
            format: ColorFormat::Float32,
            behind: [0.0; 4],
            blend: Blend::Over,
            equation: None,
            write_mask: vk::ColorComponentFlags::RGBA,
            depth: None,
            samples: 1,
            sample_mask: u32::MAX,
            rules: Rules::default(),
        }
    }

    /// The same with a changed state.
    #[must_use]
    pub fn in_state(mut self, change: impl FnOnce(State) -> State) -> Self {
        self.state = change(self.state);
        self
    }

    /// The same with another footprint.
    #[must_use]
    pub fn within(mut self, cut_off: CutOff, deviations: f32) -> Self {
        let footprint = self.footprint.unwrap_or_default();
        self.footprint = Some(footprint.cut_off(cut_off).cut_off_deviations(deviations));
        self
    }

    /// The same through another camera.
    #[must_use]
    pub fn seen_by(mut self, camera: Camera) -> Self {
        self.camera = camera;
        self
    }

    /// The same through a lens that distorts.
    #[must_use]
    pub fn through(mut self, lens: Distortion) -> Self {
        self.distortion = Some(lens);
        self
    }

    /// The viewport; the whole attachment by default.
    pub(crate) fn viewport(&self) -> vk::Viewport {
        self.viewport.unwrap_or_else(|| {
            let [width, height] = self.size.map(|side| side as f32);
            vk::Viewport::default().width(width).height(height).max_depth(1.0)
        })
    }
}
