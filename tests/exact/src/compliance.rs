//! Our own pictures of the compliance cases.

use gaurast_compliance::Case;
use gaurast_oracle::oracle::{OracleCutOff, OracleOrder, OracleState};
use gaurast_render::{CutOff, DeviceOptions, RenderError, Renderer, Settings};
use gaurast_scene::{Antialiasing, SortOrder};

/// The bytes of the picture of `case`.
pub(crate) fn bytes(options: &DeviceOptions, case: &Case) -> Result<Vec<u8>, RenderError> {
    let scene = case.source.scene(&case.camera).expect("a valid file");
    let state = case.pipeline.state(scene.metadata().order, case.is_compensated);
    let mut renderer = Renderer::with_options(vulkan_gaurast::entry(), options)?;
    let mut uploaded = renderer.upload(&scene, None)?;
    renderer.set(&mut uploaded, settings(&state))?;
    let frame = renderer.render(&uploaded, &case.camera)?;
    Ok(bytemuck::cast_slice(&frame.picture.pixels).to_vec())
}

/// The renderer's settings for the oracle's rules.
fn settings(state: &OracleState) -> Settings {
    Settings {
        alpha_ceiling: state.alpha_ceiling,
        order: match state.order {
            OracleOrder::RadialDistance => SortOrder::Distance,
            _ => SortOrder::Depth,
        },
        cut_off: match state.cut_off {
            OracleCutOff::None => CutOff::None,
            OracleCutOff::Ellipse => CutOff::Ellipse,
            OracleCutOff::TileSquare => CutOff::TileSquare,
            OracleCutOff::TileRectangle => CutOff::TileRectangle,
            OracleCutOff::TileRectangleCompensated => CutOff::TileRectangleCompensated,
        },
        cut_off_deviations: state.cut_off_deviations,
        compensation_floor: state.compensation_floor,
        antialiasing: if state.opacity_compensated { Antialiasing::Compensated } else { Antialiasing::Off },
        ..Settings::default()
    }
}
