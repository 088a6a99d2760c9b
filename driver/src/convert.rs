//! Conversion of Vulkan's values to the device's: enumerations, rectangles, clear values, strings. It happens only
//! here.

use crate::abi::error::Error;
use ash::vk;
use simdevice::Format;
use simdevice::format::{Aspect, Channel, ClearValue, Numeric};
use simdevice::state::{
    BlendEquation, BlendEquations, BlendFactor, BlendOp, CompareOp, DepthBiasUnit, LineMode, LogicOp, PolygonMode,
    Rect, ResolveMode, StencilFace, StencilOp, Topology, Viewport,
};
use simdevice::texture::{
    AddressMode, BorderColor, ChromaLocation, ComponentSwizzle, Filter, IDENTITY, MipmapMode, Reduction, Swizzle,
    YcbcrModel, YcbcrRange,
};
use std::ffi::{CStr, c_char};

/// The error of a value that an enumeration doesn't have.
fn unknown(vuid: &'static str, value: &dyn std::fmt::Debug) -> Error {
    Error::usage(vuid, format!("{value:?} is not a value of its enumeration"))
}

/// The error of a value that the device doesn't support.
fn lacking(what: &dyn std::fmt::Debug, feature: &str) -> Error {
    Error::FeatureNotPresent(format!("{what:?} (feature {feature})"))
}

/// The device's topology. The number of a patch's vertices is other state.
///
/// # Errors
/// [`Error::InvalidUsage`] for an unknown value.
pub(crate) fn topology(topology: vk::PrimitiveTopology) -> Result<Topology, Error> {
    use vk::PrimitiveTopology as T;
    match topology {
        T::POINT_LIST => Ok(Topology::PointList),
        T::LINE_LIST => Ok(Topology::LineList),
        T::LINE_STRIP => Ok(Topology::LineStrip),
        T::TRIANGLE_LIST => Ok(Topology::TriangleList),
        T::TRIANGLE_STRIP => Ok(Topology::TriangleStrip),
        T::TRIANGLE_FAN => Ok(Topology::TriangleFan),
        T::LINE_LIST_WITH_ADJACENCY => Ok(Topology::LineListWithAdjacency),
        T::LINE_STRIP_WITH_ADJACENCY => Ok(Topology::LineStripWithAdjacency),
        T::TRIANGLE_LIST_WITH_ADJACENCY => Ok(Topology::TriangleListWithAdjacency),
        T::TRIANGLE_STRIP_WITH_ADJACENCY => Ok(Topology::TriangleStripWithAdjacency),
        T::PATCH_LIST => Ok(Topology::PatchList { control_points: 0 }),
        other => Err(unknown("VUID-VkPipelineInputAssemblyStateCreateInfo-topology-parameter", &other)),
    }
}

/// The unit of a constant depth bias.
///
/// # Errors
/// [`Error::InvalidUsage`] for what is no representation.
pub(crate) fn depth_bias_unit(info: Option<&vk::DepthBiasRepresentationInfoEXT<'_>>) -> Result<DepthBiasUnit, Error> {
    use vk::DepthBiasRepresentationEXT as R;
    let Some(info) = info else {
        return Ok(DepthBiasUnit::DEFAULT);
    };
    let is_exact = info.depth_bias_exact != vk::FALSE;
    match info.depth_bias_representation {
        R::LEAST_REPRESENTABLE_VALUE_FORMAT => Ok(DepthBiasUnit::Format { is_exact }),
        R::LEAST_REPRESENTABLE_VALUE_FORCE_UNORM => Ok(DepthBiasUnit::FixedPoint { is_exact }),
        R::FLOAT => Ok(DepthBiasUnit::One),
        other => Err(Error::usage(
            "VUID-VkDepthBiasRepresentationInfoEXT-depthBiasRepresentation-parameter",
            format!("{other:?} is no representation of depth bias"),
        )),
    }
}

/// The device's polygon mode.
///
/// # Errors
/// [`Error::FeatureNotPresent`] for modes of extensions.
pub(crate) fn polygon_mode(mode: vk::PolygonMode) -> Result<PolygonMode, Error> {
    match mode {
        vk::PolygonMode::FILL => Ok(PolygonMode::Fill),
        vk::PolygonMode::LINE => Ok(PolygonMode::Line),
        vk::PolygonMode::POINT => Ok(PolygonMode::Point),
        other => Err(lacking(&other, "fillRectangleNV")),
    }
}

/// The device's rasterization of lines. The default is that of rectangles, since `strictLines` is true.
///
/// # Errors
/// [`Error::InvalidUsage`] with the id `vuid` for an unknown value.
pub(crate) fn line_mode(mode: vk::LineRasterizationModeKHR, vuid: &'static str) -> Result<LineMode, Error> {
    match mode {
        vk::LineRasterizationModeKHR::DEFAULT | vk::LineRasterizationModeKHR::RECTANGULAR => Ok(LineMode::Rectangular),
        vk::LineRasterizationModeKHR::BRESENHAM => Ok(LineMode::Bresenham),
        vk::LineRasterizationModeKHR::RECTANGULAR_SMOOTH => Ok(LineMode::Smooth),
        other => Err(unknown(vuid, &other)),
    }
}

/// The device's comparison.
///
/// # Errors
/// [`Error::InvalidUsage`] with the id `vuid` for an unknown value.
pub(crate) fn compare_op(op: vk::CompareOp, vuid: &'static str) -> Result<CompareOp, Error> {
    match op {
        vk::CompareOp::NEVER => Ok(CompareOp::Never),
        vk::CompareOp::LESS => Ok(CompareOp::Less),
        vk::CompareOp::EQUAL => Ok(CompareOp::Equal),
        vk::CompareOp::LESS_OR_EQUAL => Ok(CompareOp::LessOrEqual),
        vk::CompareOp::GREATER => Ok(CompareOp::Greater),
        vk::CompareOp::NOT_EQUAL => Ok(CompareOp::NotEqual),
        vk::CompareOp::GREATER_OR_EQUAL => Ok(CompareOp::GreaterOrEqual),
        vk::CompareOp::ALWAYS => Ok(CompareOp::Always),
        other => Err(unknown(vuid, &other)),
    }
}

/// The device's stencil operation.
///
/// # Errors
/// [`Error::InvalidUsage`] with the id `vuid` for an unknown value.
pub(crate) fn stencil_op(op: vk::StencilOp, vuid: &'static str) -> Result<StencilOp, Error> {
    match op {
        vk::StencilOp::KEEP => Ok(StencilOp::Keep),
        vk::StencilOp::ZERO => Ok(StencilOp::Zero),
        vk::StencilOp::REPLACE => Ok(StencilOp::Replace),
        vk::StencilOp::INCREMENT_AND_CLAMP => Ok(StencilOp::IncrementAndClamp),
        vk::StencilOp::DECREMENT_AND_CLAMP => Ok(StencilOp::DecrementAndClamp),
        vk::StencilOp::INVERT => Ok(StencilOp::Invert),
        vk::StencilOp::INCREMENT_AND_WRAP => Ok(StencilOp::IncrementAndWrap),
        vk::StencilOp::DECREMENT_AND_WRAP => Ok(StencilOp::DecrementAndWrap),
        other => Err(unknown(vuid, &other)),
    }
}

/// The stencil operations of one face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct StencilOps {
    /// The operation if the stencil test fails.
    pub(crate) fail: StencilOp,
    /// The operation if both tests pass.
    pub(crate) pass: StencilOp,
    /// The operation if only the depth test fails.
    pub(crate) depth_fail: StencilOp,
    /// The comparison.
    pub(crate) compare: CompareOp,
}

/// The ids of the rules that stencil operations are valid values.
pub(crate) struct StencilOpIds {
    /// The id for the operation if the stencil test fails.
    pub(crate) fail: &'static str,
    /// The id for the operation if both tests pass.
    pub(crate) pass: &'static str,
    /// The id for the operation if only the depth test fails.
    pub(crate) depth_fail: &'static str,
    /// The id for the comparison.
    pub(crate) compare: &'static str,
}

impl StencilOps {
    /// Sets the operations of a face.
    pub(crate) fn set(self, face: &mut StencilFace) {
        face.fail = self.fail;
        face.pass = self.pass;
        face.depth_fail = self.depth_fail;
        face.compare = self.compare;
    }

    /// The device's operations.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] for unknown values.
    pub(crate) fn from_vk(
        fail: vk::StencilOp,
        pass: vk::StencilOp,
        depth_fail: vk::StencilOp,
        compare: vk::CompareOp,
        ids: &StencilOpIds,
    ) -> Result<Self, Error> {
        Ok(Self {
            fail: stencil_op(fail, ids.fail)?,
            pass: stencil_op(pass, ids.pass)?,
            depth_fail: stencil_op(depth_fail, ids.depth_fail)?,
            compare: compare_op(compare, ids.compare)?,
        })
    }
}

/// The device's logic operation.
///
/// # Errors
/// [`Error::InvalidUsage`] for an unknown value.
pub(crate) fn logic_op(op: vk::LogicOp) -> Result<LogicOp, Error> {
    match op {
        vk::LogicOp::CLEAR => Ok(LogicOp::Clear),
        vk::LogicOp::AND => Ok(LogicOp::And),
        vk::LogicOp::AND_REVERSE => Ok(LogicOp::AndReverse),
        vk::LogicOp::COPY => Ok(LogicOp::Copy),
        vk::LogicOp::AND_INVERTED => Ok(LogicOp::AndInverted),
        vk::LogicOp::NO_OP => Ok(LogicOp::NoOp),
        vk::LogicOp::XOR => Ok(LogicOp::Xor),
        vk::LogicOp::OR => Ok(LogicOp::Or),
        vk::LogicOp::NOR => Ok(LogicOp::Nor),
        vk::LogicOp::EQUIVALENT => Ok(LogicOp::Equivalent),
        vk::LogicOp::INVERT => Ok(LogicOp::Invert),
        vk::LogicOp::OR_REVERSE => Ok(LogicOp::OrReverse),
        vk::LogicOp::COPY_INVERTED => Ok(LogicOp::CopyInverted),
        vk::LogicOp::OR_INVERTED => Ok(LogicOp::OrInverted),
        vk::LogicOp::NAND => Ok(LogicOp::Nand),
        vk::LogicOp::SET => Ok(LogicOp::Set),
        other => Err(unknown("VUID-VkPipelineColorBlendStateCreateInfo-logicOpEnable-00607", &other)),
    }
}

/// The blend equations of an attachment's colour and alpha.
///
/// # Errors
/// Returns an [`Error`] for unknown factors and operations.
pub(crate) fn blend_equations(state: &vk::PipelineColorBlendAttachmentState) -> Result<BlendEquations, Error> {
    let color = equation(
        state.src_color_blend_factor,
        state.dst_color_blend_factor,
        state.color_blend_op,
        [
            "VUID-VkPipelineColorBlendAttachmentState-srcColorBlendFactor-parameter",
            "VUID-VkPipelineColorBlendAttachmentState-dstColorBlendFactor-parameter",
        ],
    )?;
    let alpha = equation(
        state.src_alpha_blend_factor,
        state.dst_alpha_blend_factor,
        state.alpha_blend_op,
        [
            "VUID-VkPipelineColorBlendAttachmentState-srcAlphaBlendFactor-parameter",
            "VUID-VkPipelineColorBlendAttachmentState-dstAlphaBlendFactor-parameter",
        ],
    )?;
    Ok(BlendEquations { color, alpha })
}

/// The bits of a component mask: 0 to 3 are red, green, blue and alpha.
pub(crate) fn write_mask(mask: vk::ColorComponentFlags) -> u8 {
    (mask.as_raw() & 0xf) as u8
}

fn equation(
    source: vk::BlendFactor,
    destination: vk::BlendFactor,
    op: vk::BlendOp,
    [source_vuid, destination_vuid]: [&'static str; 2],
) -> Result<BlendEquation, Error> {
    Ok(BlendEquation {
        source: factor(source, source_vuid)?,
        destination: factor(destination, destination_vuid)?,
        op: operation(op)?,
    })
}

fn factor(factor: vk::BlendFactor, vuid: &'static str) -> Result<BlendFactor, Error> {
    use vk::BlendFactor as F;
    Ok(match factor {
        F::ZERO => BlendFactor::Zero,
        F::ONE => BlendFactor::One,
        F::SRC_COLOR => BlendFactor::SrcColor,
        F::ONE_MINUS_SRC_COLOR => BlendFactor::OneMinusSrcColor,
        F::DST_COLOR => BlendFactor::DstColor,
        F::ONE_MINUS_DST_COLOR => BlendFactor::OneMinusDstColor,
        F::SRC_ALPHA => BlendFactor::SrcAlpha,
        F::ONE_MINUS_SRC_ALPHA => BlendFactor::OneMinusSrcAlpha,
        F::DST_ALPHA => BlendFactor::DstAlpha,
        F::ONE_MINUS_DST_ALPHA => BlendFactor::OneMinusDstAlpha,
        F::CONSTANT_COLOR => BlendFactor::ConstantColor,
        F::ONE_MINUS_CONSTANT_COLOR => BlendFactor::OneMinusConstantColor,
        F::CONSTANT_ALPHA => BlendFactor::ConstantAlpha,
        F::ONE_MINUS_CONSTANT_ALPHA => BlendFactor::OneMinusConstantAlpha,
        F::SRC_ALPHA_SATURATE => BlendFactor::SrcAlphaSaturate,
        F::SRC1_COLOR => BlendFactor::Src1Color,
        F::ONE_MINUS_SRC1_COLOR => BlendFactor::OneMinusSrc1Color,
        F::SRC1_ALPHA => BlendFactor::Src1Alpha,
        F::ONE_MINUS_SRC1_ALPHA => BlendFactor::OneMinusSrc1Alpha,
        other => {
            return Err(Error::usage(vuid, format!("{other:?} is not a VkBlendFactor")));
        }
    })
}

fn operation(op: vk::BlendOp) -> Result<BlendOp, Error> {
    Ok(match op {
        vk::BlendOp::ADD => BlendOp::Add,
        vk::BlendOp::SUBTRACT => BlendOp::Subtract,
        vk::BlendOp::REVERSE_SUBTRACT => BlendOp::ReverseSubtract,
        vk::BlendOp::MIN => BlendOp::Min,
        vk::BlendOp::MAX => BlendOp::Max,
        other => {
            return Err(Error::FeatureNotPresent(format!("blend operation {other:?}")));
        }
    })
}

/// A filter for the device.
///
/// # Errors
/// [`Error::FeatureNotPresent`] for filters of extensions.
pub(crate) fn filter(filter: vk::Filter) -> Result<Filter, Error> {
    match filter {
        vk::Filter::NEAREST => Ok(Filter::Nearest),
        vk::Filter::LINEAR => Ok(Filter::Linear),
        other => Err(Error::FeatureNotPresent(format!("filter {other:?}"))),
    }
}

/// The device's mipmap mode.
pub(crate) fn mipmap_mode(mode: vk::SamplerMipmapMode) -> MipmapMode {
    match mode {
        vk::SamplerMipmapMode::LINEAR => MipmapMode::Linear,
        _ => MipmapMode::Nearest,
    }
}

/// The device's address mode.
///
/// # Errors
/// [`Error::FeatureNotPresent`] for modes of extensions.
pub(crate) fn address_mode(mode: vk::SamplerAddressMode) -> Result<AddressMode, Error> {
    match mode {
        vk::SamplerAddressMode::REPEAT => Ok(AddressMode::Repeat),
        vk::SamplerAddressMode::MIRRORED_REPEAT => Ok(AddressMode::MirroredRepeat),
        vk::SamplerAddressMode::CLAMP_TO_EDGE => Ok(AddressMode::ClampToEdge),
        vk::SamplerAddressMode::CLAMP_TO_BORDER => Ok(AddressMode::ClampToBorder),
        vk::SamplerAddressMode::MIRROR_CLAMP_TO_EDGE => Ok(AddressMode::MirrorClampToEdge),
        other => Err(Error::FeatureNotPresent(format!("address mode {other:?}"))),
    }
}

/// The device's border colour.
///
/// # Errors
/// [`Error::FeatureNotPresent`] for colours of extensions.
pub(crate) fn border_color(color: vk::BorderColor) -> Result<BorderColor, Error> {
    match color {
        vk::BorderColor::FLOAT_TRANSPARENT_BLACK | vk::BorderColor::INT_TRANSPARENT_BLACK => {
            Ok(BorderColor::TRANSPARENT_BLACK)
        }
        vk::BorderColor::FLOAT_OPAQUE_BLACK => Ok(BorderColor::FLOAT_OPAQUE_BLACK),
        vk::BorderColor::FLOAT_OPAQUE_WHITE => Ok(BorderColor::FLOAT_OPAQUE_WHITE),
        vk::BorderColor::INT_OPAQUE_BLACK => Ok(BorderColor::INT_OPAQUE_BLACK),
        vk::BorderColor::INT_OPAQUE_WHITE => Ok(BorderColor::INT_OPAQUE_WHITE),
        other => Err(Error::FeatureNotPresent(format!("border colour {other:?}"))),
    }
}

/// The device's form of a custom border colour: the bits of its components.
pub(crate) fn custom_border_color(color: vk::ClearColorValue) -> BorderColor {
    // SAFETY: every member of the union is sixteen bytes of plain data.
    BorderColor(unsafe { color.uint32 })
}

/// The device's reduction of the filtered texels: their weighted average, minimum or maximum.
///
/// # Errors
/// [`Error::FeatureNotPresent`] for modes of extensions.
pub(crate) fn reduction(mode: vk::SamplerReductionMode) -> Result<Reduction, Error> {
    match mode {
        vk::SamplerReductionMode::WEIGHTED_AVERAGE => Ok(Reduction::WeightedAverage),
        vk::SamplerReductionMode::MIN => Ok(Reduction::Min),
        vk::SamplerReductionMode::MAX => Ok(Reduction::Max),
        other => Err(Error::FeatureNotPresent(format!("reduction mode {other:?}"))),
    }
}

/// The device's model of luma and chroma.
///
/// # Errors
/// [`Error::InvalidUsage`] for an unknown value.
pub(crate) fn ycbcr_model(model: vk::SamplerYcbcrModelConversion) -> Result<YcbcrModel, Error> {
    match model {
        vk::SamplerYcbcrModelConversion::RGB_IDENTITY => Ok(YcbcrModel::RgbIdentity),
        vk::SamplerYcbcrModelConversion::YCBCR_IDENTITY => Ok(YcbcrModel::YcbcrIdentity),
        vk::SamplerYcbcrModelConversion::YCBCR_709 => Ok(YcbcrModel::Ycbcr709),
        vk::SamplerYcbcrModelConversion::YCBCR_601 => Ok(YcbcrModel::Ycbcr601),
        vk::SamplerYcbcrModelConversion::YCBCR_2020 => Ok(YcbcrModel::Ycbcr2020),
        other => Err(unknown("VUID-VkSamplerYcbcrConversionCreateInfo-ycbcrModel-parameter", &other)),
    }
}

/// The device's range of codes of luma and chroma.
///
/// # Errors
/// [`Error::InvalidUsage`] for an unknown value.
pub(crate) fn ycbcr_range(range: vk::SamplerYcbcrRange) -> Result<YcbcrRange, Error> {
    match range {
        vk::SamplerYcbcrRange::ITU_FULL => Ok(YcbcrRange::Full),
        vk::SamplerYcbcrRange::ITU_NARROW => Ok(YcbcrRange::Narrow),
        other => Err(unknown("VUID-VkSamplerYcbcrConversionCreateInfo-ycbcrRange-parameter", &other)),
    }
}

/// The device's place of chroma.
///
/// # Errors
/// [`Error::InvalidUsage`] with the id `vuid` for an unknown value.
pub(crate) fn chroma_location(location: vk::ChromaLocation, vuid: &'static str) -> Result<ChromaLocation, Error> {
    match location {
        vk::ChromaLocation::COSITED_EVEN => Ok(ChromaLocation::CositedEven),
        vk::ChromaLocation::MIDPOINT => Ok(ChromaLocation::Midpoint),
        other => Err(unknown(vuid, &other)),
    }
}

/// The aspect of a view that shaders read.
pub(crate) fn view_aspect(mask: vk::ImageAspectFlags) -> Aspect {
    if mask.contains(vk::ImageAspectFlags::DEPTH) {
        Aspect::Depth
    } else if mask.contains(vk::ImageAspectFlags::STENCIL) {
        Aspect::Stencil
    } else {
        Aspect::Color
    }
}

/// The device's component mapping.
pub(crate) fn swizzle(mapping: vk::ComponentMapping) -> Swizzle {
    let components = [mapping.r, mapping.g, mapping.b, mapping.a];
    std::array::from_fn(|index| match components[index] {
        vk::ComponentSwizzle::ZERO => ComponentSwizzle::Zero,
        vk::ComponentSwizzle::ONE => ComponentSwizzle::One,
        vk::ComponentSwizzle::R => ComponentSwizzle::Red,
        vk::ComponentSwizzle::G => ComponentSwizzle::Green,
        vk::ComponentSwizzle::B => ComponentSwizzle::Blue,
        vk::ComponentSwizzle::A => ComponentSwizzle::Alpha,
        _ => IDENTITY[index],
    })
}

/// The aspects of a mask; None if a format lacks one of them.
pub(crate) fn aspects(format: Format, mask: vk::ImageAspectFlags) -> Option<Vec<Aspect>> {
    let named = [
        (vk::ImageAspectFlags::COLOR, Aspect::Color),
        (vk::ImageAspectFlags::DEPTH, Aspect::Depth),
        (vk::ImageAspectFlags::STENCIL, Aspect::Stencil),
    ];
    let known = named.iter().fold(vk::ImageAspectFlags::empty(), |all, &(flag, _)| all | flag);
    let chosen: Vec<_> = named.iter().filter(|(flag, _)| mask.contains(*flag)).map(|&(_, aspect)| aspect).collect();
    let has = |aspect| format.aspects().contains(aspect);
    let are_there = !mask.is_empty() && known.contains(mask) && chosen.iter().all(has);
    are_there.then_some(chosen)
}

/// A viewport for the device.
pub(crate) fn viewport(viewport: vk::Viewport) -> Viewport {
    Viewport {
        x: viewport.x,
        y: viewport.y,
        width: viewport.width,
        height: viewport.height,
        min_depth: viewport.min_depth,
        max_depth: viewport.max_depth,
    }
}

/// A rectangle for the device.
pub(crate) fn rect(rect: vk::Rect2D) -> Rect {
    Rect { x: rect.offset.x, y: rect.offset.y, width: rect.extent.width, height: rect.extent.height }
}

/// A colour clear value for an image of that format. Scaled formats are cleared to integers, as Khronos' tests expect.
pub(crate) fn clear_color(format: Format, value: vk::ClearColorValue) -> ClearValue {
    // SAFETY: every member of the union is sixteen bytes of plain data, and Vulkan has the application write the one
    // that the format calls for.
    unsafe {
        match format.numeric() {
            Numeric::Sint | Numeric::Sscaled => ClearValue::Int(value.int32),
            Numeric::Uint | Numeric::Uscaled => ClearValue::Uint(value.uint32),
            _ => ClearValue::Float(value.float32),
        }
    }
}

/// A depth and stencil clear value.
pub(crate) fn clear_depth_stencil(value: vk::ClearDepthStencilValue) -> ClearValue {
    ClearValue::DepthStencil { depth: value.depth, stencil: value.stencil }
}

/// An attachment's clear value, read as its format calls for.
pub(crate) fn clear_value(format: Format, value: vk::ClearValue) -> ClearValue {
    // SAFETY: both members of the union are plain data, and Vulkan has the application write the one that the format
    // calls for. The union is as large as its largest member, so reading the colour stays inside it.
    unsafe {
        if format.has(Channel::D) || format.has(Channel::S) {
            clear_depth_stencil(value.depth_stencil)
        } else {
            clear_color(format, value.color)
        }
    }
}

/// The device's resolve mode; None if samples are not resolved.
///
/// # Errors
/// [`Error::InvalidUsage`] for modes that Vulkan does not have.
pub(crate) fn resolve_mode(mode: vk::ResolveModeFlags) -> Result<Option<ResolveMode>, Error> {
    match mode {
        vk::ResolveModeFlags::NONE => Ok(None),
        vk::ResolveModeFlags::SAMPLE_ZERO => Ok(Some(ResolveMode::SampleZero)),
        vk::ResolveModeFlags::AVERAGE => Ok(Some(ResolveMode::Average)),
        vk::ResolveModeFlags::MIN => Ok(Some(ResolveMode::Min)),
        vk::ResolveModeFlags::MAX => Ok(Some(ResolveMode::Max)),
        other => Err(Error::usage(
            "VUID-VkRenderingAttachmentInfo-resolveMode-parameter",
            format!("{other:?} is not a VkResolveModeFlagBits"),
        )),
    }
}

/// An offset in texels.
pub(crate) fn offset(offset: vk::Offset3D) -> [i32; 3] {
    [offset.x, offset.y, offset.z]
}

/// An extent in texels.
pub(crate) fn extent(extent: vk::Extent3D) -> [u32; 3] {
    [extent.width, extent.height, extent.depth]
}

/// Writes a name into a fixed array of a Vulkan structure, and truncates it if necessary.
pub(crate) fn write_string(array: &mut [c_char], text: &CStr) {
    let length = array.len().saturating_sub(1);
    for (place, &byte) in array.iter_mut().take(length).zip(text.to_bytes()) {
        *place = byte as c_char;
    }
}
