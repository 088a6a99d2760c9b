//! Vertex-shader projection: from a vertex shader's outputs for a Gaussian to the numbers that a pixel needs.

use super::compensation::CompensatedOpacity;
use super::error_model::{ErrorModel, PrecisionClass, Rounding, relaxed};
use super::own_axes::OwnAxes;
use super::render::{Projected, Reference, bounded};
use super::splat::{Cholesky, Splat};
use super::{OracleOrder, OracleState, SkipReason};

/// A vertex shader's outputs for one Gaussian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleOutputs {
    /// `gl_Position`.
    pub position: [f32; 4],
    /// xx, xy, yy in px^2, along the framebuffer's axes.
    pub covariance: [f32; 3],
    /// Its opacity.
    pub opacity: f32,
    /// Red, green, blue.
    pub color: [f32; 3],
    /// The depth key, if the pipeline names its location.
    pub key: Option<f32>,
}

/// The viewport, which may be upside down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleViewport {
    /// Its corner in pixels.
    pub corner: [f32; 2],
    /// Its width and height in pixels.
    pub size: [f32; 2],
}

/// Projects a shader's outputs, or returns the reason for which the Gaussian is not drawn.
pub fn project(outputs: &OracleOutputs, viewport: &OracleViewport, state: &OracleState) -> Result<Splat, SkipReason> {
    let [x, y, z, w] = outputs.position.map(f64::from);
    let key = outputs.key.unwrap_or(outputs.position[3]);
    let finite = [x, y, z, w].iter().all(|c| c.is_finite())
        && outputs.covariance.iter().all(|c| c.is_finite())
        && outputs.color.iter().all(|c| c.is_finite())
        && outputs.opacity.is_finite()
        && key.is_finite();
    if !finite {
        return Err(SkipReason::NonFinite);
    }
    if outputs.opacity < state.alpha_floor {
        return Err(SkipReason::OpacityBelowFloor);
    }
    // The clip volume limits depth alone.
    if w <= 0.0 || z < 0.0 {
        return Err(SkipReason::Near);
    }
    if z > w {
        return Err(SkipReason::Far);
    }
    let place = |axis: usize, ndc: f64| {
        let (corner, size) = (viewport.corner[axis], viewport.size[axis]);
        let (corner, size) = (f64::from(corner), f64::from(size));
        size / 2.0 * ndc + (corner + size / 2.0)
    };
    let mean = [place(0, x / w), place(1, y / w)];

    let low_pass = f64::from(state.low_pass);
    let [s_xx, s_xy, s_yy] = outputs.covariance.map(f64::from);
    let area2 = s_xx * s_yy - s_xy * s_xy;
    let determinant = area2 + low_pass * (s_xx + s_yy) + low_pass * low_pass;
    let covariance = [s_xx + low_pass, s_xy, s_yy + low_pass];
    if !(covariance[0] > 0.0 && determinant > 0.0) {
        return Err(SkipReason::DegenerateCovariance);
    }
    let area = area2.max(0.0).sqrt();
    let given_opacity = f64::from(outputs.opacity);
    let [factor, least_area] = state.compensation(area, determinant);
    let compensated_opacity = given_opacity * factor;
    let opacity = if state.opacity_compensated { compensated_opacity } else { given_opacity };
    let rounding = match state.rules.precision {
        PrecisionClass::Full => Rounding::FULL,
        PrecisionClass::Relaxed => Rounding {
            place: [0, 1].map(|axis| relaxed::PLACE * (f64::from(viewport.size[axis]) + mean[axis].abs())),
            determinant: relaxed::DETERMINANT * (s_xx * s_yy / determinant).abs(),
            class: PrecisionClass::Relaxed,
            ..Rounding::FULL
        },
    };
    let spread = [covariance[0].sqrt(), covariance[2].sqrt()];
    Ok(Splat {
        index: 0,
        distance: w as f32,
        mean,
        covariance,
        determinant,
        period: f64::INFINITY,
        surfel: None,
        own_axes: OwnAxes::NONE,
        may_be_folded: false,
        cholesky: Cholesky::new(covariance, determinant),
        opacity,
        compensated: CompensatedOpacity::new(compensated_opacity, least_area, spread, rounding),
        color: outputs.color.map(f64::from),
        key: match state.order {
            OracleOrder::Primitive | OracleOrder::PerPixel => 0.0,
            // Adding 0 makes a negative zero positive.
            OracleOrder::ViewDepth | OracleOrder::RadialDistance => f64::from(key) + 0.0,
        },
        z: (z / w) as f32,
        depth: 0.0,
        depth_error: 0.0,
        key_undecidable: false,
        key_terms: [0.0; 3],
        error: ErrorModel::new(spread, opacity, state.opacity_compensated.then_some(least_area), rounding),
    })
}

/// Draws a shader's outputs for the Gaussians of a draw, in primitive order, to a framebuffer that the viewport covers.
pub fn render_shaded(
    outputs: &[OracleOutputs],
    size: [u32; 2],
    viewport: &OracleViewport,
    state: &OracleState,
) -> Reference {
    let all = outputs.iter().map(|one| project(one, viewport, state));
    bounded(&Projected::sort(all, state), size, state)
}
