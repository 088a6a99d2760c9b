//! Steps 1 to 5: from a Gaussian in world space to the numbers that a pixel needs.

use super::compensation::CompensatedOpacity;
use super::error_model::{ErrorModel, PrecisionClass, Rounding, UNIT_ROUNDOFF, relaxed};
use super::instance::Model;
use super::own_axes::OwnAxes;
use super::panorama;
use super::projection::{depth_variable, ideal_radius, mean_and_jacobian};
use super::rules::ColorDirection;
use super::spherical_harmonics;
use super::splat::{Cholesky, Splat};
use super::surfel::{self, Surfel};
use super::unscented::{self, Deviation, Transformed};
use super::vectors::{dot, length, multiply_row, subtract, transform};
use super::{
    OracleCamera, OracleCutOff, OracleGeometry, OracleInstance, OracleOrder, OracleScene, OracleState, SkipReason,
};

/// Projects Gaussian `index`, or returns the reason for which it is not drawn.
pub fn project(
    scene: &OracleScene,
    camera: &OracleCamera,
    state: &OracleState,
    index: usize,
) -> Result<Splat, SkipReason> {
    check_attributes(scene, state, index)?;
    let rules = &state.rules;

    // Step 2. Camera space, and the depth key.
    let rotation = camera.rotation.map(f64::from);
    let position = scene.positions[index].map(f64::from);
    let model = Model::new(&scene.instance(index));
    let offset = subtract(model.point(position), camera.eye);
    let t = transform(&rotation, offset);
    let depth = depth_variable(camera.model, t);
    let z = depth as f32;
    // NaN fails both comparisons.
    let (beyond_near, before_far) = (camera.near < z, z < camera.far);
    if !beyond_near {
        return Err(SkipReason::Near);
    }
    if !before_far {
        return Err(SkipReason::Far);
    }
    let sort_by = match state.order {
        OracleOrder::ViewDepth => depth,
        OracleOrder::RadialDistance => length(offset),
        OracleOrder::Primitive | OracleOrder::PerPixel => 0.0,
    };

    // The magnitudes of the operands whose difference is the offset.
    let operands = length([0, 1, 2].map(|i| {
        let terms = model.linear[i].iter().zip(position).map(|(a, p)| (a * p).abs()).sum::<f64>();
        terms + model.translation[i].abs() + camera.eye[i].abs()
    }));

    // Step 3. The mean and the Jacobian of the projection.
    let radius = ideal_radius(camera, rules, t);
    let fold = camera.lens.filter(|_| rules.lenses_fold).map(|lens| lens.fold());
    if fold.is_some_and(|fold| radius >= fold.greatest) {
        return Err(SkipReason::BeyondFold);
    }
    let (mut mean, jacobian) = mean_and_jacobian(camera, rules, t);
    let scale = scales(scene, state, index).map(f64::from);
    let axes = rotation_matrix(scene.rotations[index].map(f64::from));
    let m = jacobian.map(|row| {
        let in_world = multiply_row(row, &rotation);
        let in_axes = multiply_row(model.row(in_world), &axes);
        [in_axes[0] * scale[0], in_axes[1] * scale[1], in_axes[2] * scale[2]]
    });

    // The columns of M, or those of the unscented transform in their place.
    let mut columns: Vec<Deviation> = (0..3).map(|k| Deviation { at: [m[0][k], m[1][k]], sign: 1.0 }).collect();
    let largest_scale = scale[0].max(scale[1]).max(scale[2]);
    let mut spread = jacobian.map(|row| {
        let row = model.row(multiply_row(row, &rotation));
        length(row) * largest_scale
    });
    let (mut steepest, mut weights) = (jacobian.map(length), None);
    if state.unscented && model.is_regular() {
        let axes = [0, 1, 2].map(|k| {
            let axis = [axes[k], axes[3 + k], axes[6 + k]].map(|c| c * scale[k]);
            transform(&rotation, model.vector(axis))
        });
        match unscented::transform(camera, state, t, &axes) {
            Transformed::Moments(moments) => {
                spread = [0, 1].map(|i| moments.deviations.iter().map(|d| d.at[i].abs()).sum());
                (steepest, weights) = (moments.steepest, Some(moments.weights));
                (mean, columns) = (moments.mean, moments.deviations);
            }
            Transformed::Unseen => {}
            Transformed::OutsidePicture => return Err(SkipReason::OutsidePicture),
        }
    }

    // Step 4. Covariance and determinant.
    let low_pass = f64::from(state.low_pass);
    let spread = spread.map(|spread| spread.hypot(low_pass.sqrt()));
    let before = determinant_of(&columns);
    let area = before.max(0.0).sqrt();
    let sum = |i: usize, j: usize| columns.iter().map(|c| c.sign * c.at[i] * c.at[j]).sum::<f64>();
    let (s_xx, s_xy, s_yy) = (sum(0, 0), sum(0, 1), sum(1, 1));
    let determinant = before + low_pass * (s_xx + s_yy) + low_pass * low_pass;
    let is_flat = state.geometry == OracleGeometry::Surfel;
    let is_positive = determinant > 0.0 && s_xx + low_pass >= 0.0 && s_yy + low_pass >= 0.0;
    let is_regular = is_positive && determinant.is_finite() && model.is_regular();
    if !is_flat && !is_regular {
        return Err(SkipReason::DegenerateCovariance);
    }
    let covariance = [s_xx + low_pass, s_xy, s_yy + low_pass];
    let given_opacity = f64::from(scene.opacity(index));
    let [factor, least_area] = state.compensation(area, determinant);
    let compensated_opacity = given_opacity * factor;
    let opacity = if state.opacity_compensated { compensated_opacity } else { given_opacity };

    // Step 5. Colour.
    let toward = match rules.color_direction {
        ColorDirection::FromEye => model.solve(offset),
        ColorDirection::ToEye => model.solve(offset).map(|c| -c),
        ColorDirection::FromEyeInWorld => offset,
    };
    let direction = toward.map(|c| c / length(toward));
    let color = spherical_harmonics::color(scene.degree(), direction, scene.coefficients(index));

    let rounding = match rules.precision {
        PrecisionClass::Full => Rounding::FULL,
        PrecisionClass::Relaxed => {
            let nearness = 1.0 + operands / depth.abs();
            let sides = [camera.width, camera.height].map(f64::from);
            let magnitudes = [0, 1].map(|i| {
                let still = sides[i] + f64::from(camera.principal[i]).abs() + mean[i].abs();
                still + steepest[i] * operands
            });
            let place = magnitudes.map(|magnitude| relaxed::PLACE * weights.unwrap_or(1.0) * magnitude);
            let coefficients = scene.coefficients(index).iter();
            let terms = coefficients.map(|triple| triple.iter().fold(0.0, |most: f64, c| most.max(c.abs().into())));
            Rounding {
                place,
                points: if weights.is_some() { place } else { [0.0; 2] },
                nearness,
                depth: relaxed::DEPTH * UNIT_ROUNDOFF * operands,
                determinant: 0.0,
                color: relaxed::COLOR * UNIT_ROUNDOFF * nearness * (1.0 + terms.sum::<f64>()),
                class: PrecisionClass::Relaxed,
            }
        }
    };

    // The rounding errors of a model matrix's products and sums. Without a matrix there is only a difference, rounded
    // once.
    let instance = scene.instance(index);
    let lost = if instance == OracleInstance::default() {
        0.0
    } else {
        let terms = model.linear.map(|row| dot(row.map(f64::abs), position.map(f64::abs)));
        4.0 * f64::EPSILON * (length(terms) + length(model.translation) + length(camera.eye))
    };
    let disc = [0, 1].map(|axis| {
        let own = [axes[axis], axes[3 + axis], axes[6 + axis]];
        transform(&rotation, own.map(|c| c * scale[axis]))
    });
    let (mut middle, mut rectangle) = (mean, None);
    if is_flat && state.cut_off == OracleCutOff::TileRectangle {
        let Some([shift, halves]) = surfel::rectangle(camera, disc, t) else {
            return Err(SkipReason::DegenerateCovariance);
        };
        middle = [0, 1].map(|axis| mean[axis] + shift[axis]);
        rectangle = Some(halves.map(|half| half * half));
    }
    Ok(Splat {
        index,
        mean,
        covariance,
        determinant,
        period: panorama::period(camera, rules),
        cholesky: Cholesky::new(covariance, determinant),
        opacity,
        compensated: CompensatedOpacity::new(compensated_opacity, least_area, spread, rounding),
        color,
        key: rules.key_rounding.key(sort_by),
        z,
        distance: z,
        depth: 0.0,
        depth_error: 0.0,
        surfel: is_flat.then(|| Surfel {
            camera: *camera,
            axes: disc,
            centre: t,
            mean: middle,
            rectangle,
            low_pass,
            beyond: if rules.discs_begin_at_near { camera.near.into() } else { f64::NEG_INFINITY },
            fixed: rounding.fixed() + 2.0 * opacity.max(f64::MIN_POSITIVE).log2().abs(),
            operands,
            rounding,
        }),
        own_axes: OwnAxes::new(&axes, scale, offset),
        may_be_folded: fold.is_some_and(|fold| radius >= fold.least),
        key_undecidable: state.order.has_keys() && key_is_undecidable(&rotation, offset, lost, sort_by),
        key_terms: [0, 1, 2].map(|i| rotation[6 + i] * model.point(position)[i]),
        error: ErrorModel::new(spread, opacity, state.opacity_compensated.then_some(least_area), rounding),
    })
}

/// The determinant of a covariance that is a sum of squares of columns: that of the squares of their 2x2 minors; of three
/// columns, |m0 x m1|^2.
fn determinant_of(columns: &[Deviation]) -> f64 {
    let mut sum = 0.0;
    for (index, a) in columns.iter().enumerate() {
        for b in &columns[..index] {
            sum += a.sign * b.sign * (a.at[0] * b.at[1] - a.at[1] * b.at[0]).powi(2);
        }
    }
    sum
}

/// The three scales; the third is 0 for a disc.
fn scales(scene: &OracleScene, state: &OracleState, index: usize) -> [f32; 3] {
    let [x, y, z] = scene.scales[index];
    match state.geometry {
        OracleGeometry::Volume => [x, y, z],
        OracleGeometry::Surfel => [x, y, 0.0],
    }
}

/// Step 1: the checks that need no camera.
fn check_attributes(scene: &OracleScene, state: &OracleState, index: usize) -> Result<(), SkipReason> {
    let (scale, quaternion) = (scales(scene, state, index), scene.rotations[index]);
    let opacity = scene.opacity(index);
    let matrix = scene.instance(index).matrix;
    let finite = scene.positions[index].iter().all(|c| c.is_finite())
        && scale.iter().all(|c| c.is_finite())
        && quaternion.iter().all(|c| c.is_finite())
        && opacity.is_finite()
        && matrix.as_flattened().iter().all(|c| c.is_finite())
        && scene.coefficients(index).as_flattened().iter().all(|c| c.is_finite());
    if !finite {
        return Err(SkipReason::NonFinite);
    }
    if quaternion == [0.0; 4] {
        return Err(SkipReason::ZeroQuaternion);
    }
    if scale.iter().any(|&s| s < 0.0) {
        return Err(SkipReason::NegativeScale);
    }
    if opacity < state.alpha_floor {
        return Err(SkipReason::OpacityBelowFloor);
    }
    Ok(())
}

/// The rotation matrix (row-major) of a quaternion `w, x, y, z` that is not zero. It is divided by
/// its largest component first, so that no square under- or overflows.
fn rotation_matrix(quaternion: [f64; 4]) -> [f64; 9] {
    let largest = quaternion.iter().fold(0.0, |a: f64, c| a.max(c.abs()));
    let scaled = quaternion.map(|c| c / largest);
    let norm = scaled.iter().map(|c| c * c).sum::<f64>().sqrt();
    let [w, x, y, z] = scaled.map(|c| c / norm);
    [
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    ]
}

/// True if the binary64 error of the sort value reaches across the midpoint of two binary32 values.
///
/// Camera coordinates are sums of three products of differences: five roundings at most on each term. A length adds
/// three more, and its error is at most that of the vector.
fn key_is_undecidable(rotation: &[f64; 9], offset: [f64; 3], lost: f64, sort_by: f64) -> bool {
    let magnitude = |row: usize| -> f64 { (0..3).map(|i| (rotation[3 * row + i] * offset[i]).abs()).sum() };
    let error = lost + 2.5 * f64::EPSILON * length([0, 1, 2].map(magnitude)) + 2.0 * f64::EPSILON * sort_by.abs();
    (sort_by - error) as f32 != (sort_by + error) as f32
}
