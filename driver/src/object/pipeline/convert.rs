//! Vulkan's enumerations as the device's.

use crate::error::Error;
use ash::vk;
use simdevice::state::{CompareOp, LogicOp, PolygonMode, StencilOp, Topology};

/// A value that is none of an enumeration's.
fn unknown(vuid: &'static str, value: &dyn std::fmt::Debug) -> Error {
    Error::usage(vuid, format!("{value:?} is not a value of its enumeration"))
}

/// What the device lacks.
fn lacking(what: &dyn std::fmt::Debug, feature: &str) -> Error {
    Error::FeatureNotPresent(format!("{what:?} (feature {feature})"))
}

/// How vertices make primitives.
///
/// # Errors
/// [`Error::FeatureNotPresent`] for topologies that only geometry and tessellation stages take.
pub(crate) fn topology(topology: vk::PrimitiveTopology) -> Result<Topology, Error> {
    use vk::PrimitiveTopology as T;
    match topology {
        T::POINT_LIST => Ok(Topology::PointList),
        T::LINE_LIST => Ok(Topology::LineList),
        T::LINE_STRIP => Ok(Topology::LineStrip),
        T::TRIANGLE_LIST => Ok(Topology::TriangleList),
        T::TRIANGLE_STRIP => Ok(Topology::TriangleStrip),
        T::TRIANGLE_FAN => Ok(Topology::TriangleFan),
        T::LINE_LIST_WITH_ADJACENCY
        | T::LINE_STRIP_WITH_ADJACENCY
        | T::TRIANGLE_LIST_WITH_ADJACENCY
        | T::TRIANGLE_STRIP_WITH_ADJACENCY => Err(lacking(&topology, "geometryShader")),
        T::PATCH_LIST => Err(lacking(&topology, "tessellationShader")),
        other => Err(unknown(
            "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-parameter",
            &other,
        )),
    }
}

/// What of a polygon is drawn.
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

/// A comparison.
///
/// # Errors
/// [`Error::Usage`] for what is none.
pub(crate) fn compare_op(op: vk::CompareOp) -> Result<CompareOp, Error> {
    match op {
        vk::CompareOp::NEVER => Ok(CompareOp::Never),
        vk::CompareOp::LESS => Ok(CompareOp::Less),
        vk::CompareOp::EQUAL => Ok(CompareOp::Equal),
        vk::CompareOp::LESS_OR_EQUAL => Ok(CompareOp::LessOrEqual),
        vk::CompareOp::GREATER => Ok(CompareOp::Greater),
        vk::CompareOp::NOT_EQUAL => Ok(CompareOp::NotEqual),
        vk::CompareOp::GREATER_OR_EQUAL => Ok(CompareOp::GreaterOrEqual),
        vk::CompareOp::ALWAYS => Ok(CompareOp::Always),
        other => Err(unknown("VUID-VkCompareOp-parameter", &other)),
    }
}

/// What becomes of a stencil value.
///
/// # Errors
/// [`Error::Usage`] for what is no such operation.
pub(crate) fn stencil_op(op: vk::StencilOp) -> Result<StencilOp, Error> {
    match op {
        vk::StencilOp::KEEP => Ok(StencilOp::Keep),
        vk::StencilOp::ZERO => Ok(StencilOp::Zero),
        vk::StencilOp::REPLACE => Ok(StencilOp::Replace),
        vk::StencilOp::INCREMENT_AND_CLAMP => Ok(StencilOp::IncrementAndClamp),
        vk::StencilOp::DECREMENT_AND_CLAMP => Ok(StencilOp::DecrementAndClamp),
        vk::StencilOp::INVERT => Ok(StencilOp::Invert),
        vk::StencilOp::INCREMENT_AND_WRAP => Ok(StencilOp::IncrementAndWrap),
        vk::StencilOp::DECREMENT_AND_WRAP => Ok(StencilOp::DecrementAndWrap),
        other => Err(unknown("VUID-VkStencilOp-parameter", &other)),
    }
}

/// A logic operation.
///
/// # Errors
/// [`Error::Usage`] for what is none.
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
        other => Err(unknown(
            "VUID-VkPipelineColorBlendStateCreateInfo-logicOpEnable-00607",
            &other,
        )),
    }
}
