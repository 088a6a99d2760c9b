//! Fixed-function state that the command buffer may set: one setting of it.

use super::convert;
use crate::error::Error;
use ash::vk;
use simdevice::state::{CompareOp, DepthBias, StencilOp, Topology};

/// The face that a stencil setting is for: 0 is the front, 1 the back.
pub(crate) type Face = usize;

/// The stencil operations of one face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct StencilOps {
    /// When the stencil test fails.
    pub(crate) fail: StencilOp,
    /// When both tests pass.
    pub(crate) pass: StencilOp,
    /// When only the depth test fails.
    pub(crate) depth_fail: StencilOp,
    /// The comparison.
    pub(crate) compare: CompareOp,
}

/// One `vkCmdSet...`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs, reason = "the names are those of Vulkan's commands")]
pub(crate) enum Setting {
    LineWidth(f32),
    DepthBias(DepthBias),
    DepthBiasEnable(bool),
    BlendConstants([f32; 4]),
    DepthBounds(f32, f32),
    DepthBoundsTestEnable(bool),
    DepthTestEnable(bool),
    DepthWriteEnable(bool),
    DepthCompareOp(CompareOp),
    StencilTestEnable(bool),
    StencilOp(Face, StencilOps),
    StencilCompareMask(Face, u8),
    StencilWriteMask(Face, u8),
    StencilReference(Face, u8),
    CullMode { front: bool, back: bool },
    FrontFaceClockwise(bool),
    PrimitiveTopology(Topology),
    PrimitiveRestartEnable(bool),
    RasterizerDiscardEnable(bool),
}

impl Setting {
    /// What is set.
    pub(crate) fn state(self) -> vk::DynamicState {
        use vk::DynamicState as S;
        match self {
            Self::LineWidth(_) => S::LINE_WIDTH,
            Self::DepthBias(_) => S::DEPTH_BIAS,
            Self::DepthBiasEnable(_) => S::DEPTH_BIAS_ENABLE,
            Self::BlendConstants(_) => S::BLEND_CONSTANTS,
            Self::DepthBounds(..) => S::DEPTH_BOUNDS,
            Self::DepthBoundsTestEnable(_) => S::DEPTH_BOUNDS_TEST_ENABLE,
            Self::DepthTestEnable(_) => S::DEPTH_TEST_ENABLE,
            Self::DepthWriteEnable(_) => S::DEPTH_WRITE_ENABLE,
            Self::DepthCompareOp(_) => S::DEPTH_COMPARE_OP,
            Self::StencilTestEnable(_) => S::STENCIL_TEST_ENABLE,
            Self::StencilOp(..) => S::STENCIL_OP,
            Self::StencilCompareMask(..) => S::STENCIL_COMPARE_MASK,
            Self::StencilWriteMask(..) => S::STENCIL_WRITE_MASK,
            Self::StencilReference(..) => S::STENCIL_REFERENCE,
            Self::CullMode { .. } => S::CULL_MODE,
            Self::FrontFaceClockwise(_) => S::FRONT_FACE,
            Self::PrimitiveTopology(_) => S::PRIMITIVE_TOPOLOGY,
            Self::PrimitiveRestartEnable(_) => S::PRIMITIVE_RESTART_ENABLE,
            Self::RasterizerDiscardEnable(_) => S::RASTERIZER_DISCARD_ENABLE,
        }
    }

    /// The face it is for, if it is for one.
    fn face(self) -> Option<Face> {
        match self {
            Self::StencilOp(face, _)
            | Self::StencilCompareMask(face, _)
            | Self::StencilWriteMask(face, _)
            | Self::StencilReference(face, _) => Some(face),
            _ => None,
        }
    }
}

/// The faces that a mask names.
pub(crate) fn faces(mask: vk::StencilFaceFlags) -> impl Iterator<Item = Face> {
    let flags = [vk::StencilFaceFlags::FRONT, vk::StencilFaceFlags::BACK];
    (0..)
        .zip(flags)
        .filter_map(move |(face, flag)| mask.contains(flag).then_some(face))
}

/// Which faces a cull mode culls.
pub(crate) fn cull_mode(mode: vk::CullModeFlags) -> Setting {
    Setting::CullMode {
        front: mode.contains(vk::CullModeFlags::FRONT),
        back: mode.contains(vk::CullModeFlags::BACK),
    }
}

/// Which face is the front.
pub(crate) fn front_face(face: vk::FrontFace) -> Setting {
    Setting::FrontFaceClockwise(face == vk::FrontFace::CLOCKWISE)
}

/// Stencil operations.
///
/// # Errors
/// [`Error::Usage`] for what is none.
pub(crate) fn stencil_ops(
    fail: vk::StencilOp,
    pass: vk::StencilOp,
    depth_fail: vk::StencilOp,
    compare: vk::CompareOp,
) -> Result<StencilOps, Error> {
    Ok(StencilOps {
        fail: convert::stencil_op(fail)?,
        pass: convert::stencil_op(pass)?,
        depth_fail: convert::stencil_op(depth_fail)?,
        compare: convert::compare_op(compare)?,
    })
}

/// What a command buffer has set so far; the last of each.
#[derive(Clone, Debug, Default)]
pub(crate) struct Settings(Vec<Setting>);

impl Settings {
    /// Sets something, instead of what was set before.
    pub(crate) fn set(&mut self, setting: Setting) {
        let key = |setting: Setting| (setting.state(), setting.face());
        match self.0.iter_mut().find(|old| key(**old) == key(setting)) {
            Some(old) => *old = setting,
            None => self.0.push(setting),
        }
    }

    /// What was set of a state.
    pub(crate) fn of(&self, state: vk::DynamicState) -> impl Iterator<Item = Setting> {
        self.0.iter().copied().filter(move |it| it.state() == state)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_setting_of_a_face_holds() {
        let mut settings = Settings::default();
        for face in faces(vk::StencilFaceFlags::FRONT_AND_BACK) {
            settings.set(Setting::StencilReference(face, 1));
        }
        for face in faces(vk::StencilFaceFlags::BACK) {
            settings.set(Setting::StencilReference(face, 2));
        }
        settings.set(Setting::LineWidth(3.0));
        let of = |state| settings.of(state).collect::<Vec<_>>();
        assert_eq!(
            of(vk::DynamicState::STENCIL_REFERENCE),
            [
                Setting::StencilReference(0, 1),
                Setting::StencilReference(1, 2)
            ]
        );
        assert_eq!(of(vk::DynamicState::LINE_WIDTH), [Setting::LineWidth(3.0)]);
        assert!(of(vk::DynamicState::DEPTH_BIAS).is_empty());
    }
}
