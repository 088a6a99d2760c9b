//! Gaussians of a draw by what becomes of them, and what is surely not meant.

use gaurast::vk::{GaussianCameraModelGAURAST as Model, PipelineGaussianStateCreateFlagsGAURAST as Flags};

use crate::facts::Camera;
use crate::recording::Draw;
use crate::report::Faults;
use crate::rules::gaussians::{Gaussian, Gaussians, fetch};
use crate::rules::sizes::Sizes;

/// The share of a draw's Gaussians from which on something is no accident, as a divisor.
const SHARE: u64 = 20;

/// Gaussians of a draw by what becomes of them.
#[derive(Debug, Default)]
struct Counts {
    all: u64,
    not_finite: u64,
    zero_quaternion: u64,
    negative_scale: u64,
    below_floor: u64,
    behind: u64,
    beyond: u64,
    outside: u64,
    drawn: u64,
    // What follows is counted beside.
    opacity_outside: u64,
    opacity_inside: u64,
    last_is_greatest: u64,
    is_last_axis: u64,
    small_scales: u64,
    no_model_opacity: u64,
    no_scale: u64,
    seen: u64,
    seen_transposed: u64,
    cut_by_near_plane: u64,
    colors: Colors,
    sizes: Sizes,
}

/// The coefficients of degree 0.
#[derive(Debug)]
struct Colors {
    number: u64,
    least: f32,
    greatest: f32,
    are_integers: bool,
}

impl Default for Colors {
    fn default() -> Self {
        Self { number: 0, least: f32::INFINITY, greatest: f32::NEG_INFINITY, are_integers: true }
    }
}

impl Colors {
    fn add(&mut self, color: [f32; 3]) {
        self.number += 1;
        for value in color {
            self.least = self.least.min(value);
            self.greatest = self.greatest.max(value);
            self.are_integers &= value.fract() == 0.0;
        }
    }

    /// The likely meaning of the values, if they are no coefficients.
    fn told(&self) -> Option<&'static str> {
        let range = self.least..=self.greatest;
        if self.number >= 16
            && self.least >= 0.0
            && self.greatest <= 1.0
            && range.contains(&0.25)
            && range.contains(&0.75)
        {
            return Some("colours from 0 to 1");
        }
        let are_bytes = self.are_integers && self.least >= 0.0 && (16.0..=255.0).contains(&self.greatest);
        (self.number > 0 && are_bytes).then_some("colours from 0 to 255")
    }
}

/// Counts the Gaussians of a draw, and tells what is surely not meant.
pub(crate) fn count(draw: &Draw, gaussians: &Gaussians, camera: Option<&Camera>, faults: &mut Faults) {
    let mut counts = Counts::default();
    for instance in 0..gaussians.instances {
        for &vertex in &gaussians.vertices {
            if let Some(gaussian) = fetch(draw, gaussians, vertex, instance) {
                counts.add(draw, &gaussian, camera);
            }
        }
    }
    if counts.all > 0 {
        tell(draw, &counts, gaussians.total, faults);
    }
}

impl Counts {
    fn add(&mut self, draw: &Draw, gaussian: &Gaussian, camera: Option<&Camera>) {
        self.all += 1;
        let g = gaussian;
        let is_logit = draw.state.flags.contains(Flags::LOGIT_OPACITY);
        let is_log = draw.state.flags.contains(Flags::LOG_SCALE);
        let is_inside = (0.0..=1.0).contains(&g.opacity);
        self.opacity_outside += u64::from(!is_logit && !is_inside && g.opacity.is_finite());
        self.opacity_inside += u64::from(is_logit && is_inside);
        self.small_scales += u64::from(is_log && g.scale.iter().all(|s| (0.0..=1.0).contains(s)));
        let [w, x, y, z] = g.rotation.map(f32::abs);
        self.last_is_greatest += u64::from(z > w && z > x && z > y);
        self.is_last_axis += u64::from(w == 0.0 && x == 0.0 && y == 0.0 && z > 0.0);
        self.no_model_opacity += u64::from(g.model_opacity == Some(0.0));
        self.no_scale += u64::from(!is_log && g.scale == [0.0; 3]);
        if let Some(color) = g.color {
            self.colors.add(color);
        }
        if g.model.is_none() {
            let scale = if is_log { g.scale.map(f32::exp) } else { g.scale };
            self.sizes.add(g.position, scale);
        }
        if let (Some(camera), Some(viewport)) = (camera, draw.viewport) {
            self.see(camera, g, viewport);
        }
        *self.place(draw, g, camera) += 1;
    }

    /// Counts a Gaussian that is seen, or would be seen by another camera.
    fn see(&mut self, camera: &Camera, gaussian: &Gaussian, viewport: [f32; 4]) {
        let near = f64::from(camera.near_plane);
        if let Some(depth) = depth_in_picture(camera, &camera.rotation, gaussian, viewport) {
            let is_near = depth <= near;
            self.seen += u64::from(!is_near);
            self.cut_by_near_plane += u64::from(is_near);
        }
        let [a, b, c, d, e, f, g, h, i] = camera.rotation;
        let transposed = [a, d, g, b, e, h, c, f, i];
        let depth = depth_in_picture(camera, &transposed, gaussian, viewport);
        self.seen_transposed += u64::from(depth.is_some_and(|depth| depth > near));
    }

    /// The count of what becomes of a Gaussian, by the first reason that holds.
    fn place(&mut self, draw: &Draw, gaussian: &Gaussian, camera: Option<&Camera>) -> &mut u64 {
        let g = gaussian;
        let (flags, state) = (draw.state.flags, &draw.state);
        let finite = |values: &[f32]| values.iter().all(|value| value.is_finite());
        let is_log = flags.contains(Flags::LOG_SCALE);
        let scale = if is_log { g.scale.map(f32::exp) } else { g.scale };
        let mut opacity = g.opacity;
        if flags.contains(Flags::LOGIT_OPACITY) {
            opacity = 1.0 / (1.0 + (-opacity).exp());
        }
        opacity *= g.model_opacity.unwrap_or(1.0);
        let model_is_finite = g.model.is_none_or(|model| finite(model.as_flattened()));
        let is_finite = finite(&g.position)
            && finite(&scale)
            && finite(&g.rotation)
            && opacity.is_finite()
            && g.harmonics_are_finite
            && model_is_finite;
        if !is_finite {
            return &mut self.not_finite;
        }
        if g.rotation == [0.0; 4] {
            return &mut self.zero_quaternion;
        }
        if scale.iter().any(|&s| s < 0.0) {
            return &mut self.negative_scale;
        }
        if opacity < state.alpha_floor {
            return &mut self.below_floor;
        }
        let Some(camera) = camera else {
            return &mut self.drawn;
        };
        match place(camera, g, scale, state.low_pass_variance, draw.viewport) {
            Place::Behind => &mut self.behind,
            Place::Beyond => &mut self.beyond,
            // A lens may show what lies outside of an ideal picture.
            Place::Outside if camera.distorts => &mut self.drawn,
            Place::Outside => &mut self.outside,
            Place::Inside => &mut self.drawn,
        }
    }
}

/// The place of a Gaussian, seen from the camera.
enum Place {
    Behind,
    Beyond,
    Outside,
    Inside,
}

/// The world-space position of a Gaussian, from its model matrix if it has one.
fn world_position(gaussian: &Gaussian) -> [f64; 3] {
    let [x, y, z] = gaussian.position.map(f64::from);
    match gaussian.model {
        None => [x, y, z],
        Some(model) => model.map(|row| {
            let [a, b, c, d] = row.map(f64::from);
            a * x + b * y + c * z + d
        }),
    }
}

/// The depth variable of a Gaussian whose centre is in the picture of a flat camera, in front of the eye, with another
/// rotation.
fn depth_in_picture(camera: &Camera, rotation: &[f32; 9], gaussian: &Gaussian, viewport: [f32; 4]) -> Option<f64> {
    let is_pinhole = camera.model == Model::PINHOLE;
    if !is_pinhole && camera.model != Model::ORTHOGRAPHIC {
        return None;
    }
    let position = world_position(gaussian);
    let [x, y, z] = std::array::from_fn(|axis| position[axis] - camera.eye[axis]);
    let row = |row: usize| {
        let r = |column: usize| f64::from(rotation[3 * row + column]);
        r(0) * x + r(1) * y + r(2) * z
    };
    let (seen, depth) = ([row(0), row(1)], row(2));
    let unit = if is_pinhole { depth } else { 1.0 };
    let is_inside = |axis: usize| {
        let at = f64::from(camera.focal_length[axis]) * seen[axis] / unit + f64::from(camera.principal_point[axis]);
        at >= 0.0 && at <= f64::from(viewport[2 + axis].abs())
    };
    (depth > 0.0 && is_inside(0) && is_inside(1)).then_some(depth)
}

fn place(camera: &Camera, gaussian: &Gaussian, scale: [f32; 3], low_pass: f32, viewport: Option<[f32; 4]>) -> Place {
    let position = world_position(gaussian);
    let mut size = f64::from(scale.into_iter().fold(0.0, f32::max));
    if let Some(model) = gaussian.model {
        let rows = model.map(|row| row.map(f64::from));
        let norm: f64 = rows.iter().flat_map(|row| &row[..3]).map(|value| value * value).sum();
        size *= norm.sqrt();
    }
    let [x, y, z] = std::array::from_fn(|axis| position[axis] - camera.eye[axis]);
    let row = |row: usize| {
        let r = |column: usize| f64::from(camera.rotation[3 * row + column]);
        r(0) * x + r(1) * y + r(2) * z
    };
    let [x, y, z] = [row(0), row(1), row(2)];
    let is_flat = camera.model == Model::PINHOLE || camera.model == Model::ORTHOGRAPHIC;
    let depth = if is_flat { z } else { (x * x + y * y + z * z).sqrt() };
    if depth <= f64::from(camera.near_plane) {
        return Place::Behind;
    }
    if depth >= f64::from(camera.far_plane) {
        return Place::Beyond;
    }
    let Some([_, _, width, height]) = viewport.filter(|_| is_flat) else {
        return Place::Inside;
    };
    let unit = if camera.model == Model::PINHOLE { z } else { 1.0 };
    // Six standard deviations, as wide as they may become at a grazing angle.
    let blur = 6.0 * f64::from(low_pass).sqrt();
    let is_near = |axis: usize, t: f64, side: f32| {
        let f = f64::from(camera.focal_length[axis]);
        let at = f * t / unit + f64::from(camera.principal_point[axis]);
        let slant = if camera.model == Model::PINHOLE { 1.0 + (t / z).abs() } else { 1.0 };
        let radius = 6.0 * f * size / unit * slant + blur;
        at >= -radius && at <= f64::from(side.abs()) + radius
    };
    if is_near(0, x, width) && is_near(1, y, height) { Place::Inside } else { Place::Outside }
}

/// Tells what is surely not meant.
fn tell(draw: &Draw, counts: &Counts, total: u64, faults: &mut Faults) {
    let c = counts;
    let all = c.all;
    let of = if all == total { format!("{all}") } else { format!("the first {all}") };
    let is_some_share = |count: u64| count > 0 && count * SHARE >= all;
    let nothing = if c.drawn == 0 { "; nothing is drawn" } else { "" };
    let before = faults.0.len();
    if c.not_finite > 0 {
        faults.warning(
            "GAURAST-Draw-not-finite",
            format!(
                "{} of {of} Gaussians have a position, scale, rotation, opacity, coefficient or matrix that is NaN \
                     or infinite, and are \
                 skipped{nothing}",
                c.not_finite
            ),
        );
    }
    if is_some_share(c.zero_quaternion) {
        faults.warning(
            "GAURAST-Draw-zero-quaternion",
            format!("{} of {of} Gaussians have a rotation of zeros, and are skipped{nothing}", c.zero_quaternion),
        );
    }
    if is_some_share(c.negative_scale) {
        faults.warning(
            "GAURAST-Draw-negative-scale",
            format!(
                "{} of {of} Gaussians have a negative scale, and are skipped{nothing}. Are they logarithms, as \
                     trained files hold \
                 them? Set VK_PIPELINE_GAUSSIAN_STATE_CREATE_LOG_SCALE_BIT_GAURAST",
                c.negative_scale
            ),
        );
    }
    if is_some_share(c.opacity_outside) {
        faults.warning(
            "GAURAST-Draw-opacity-outside",
            format!(
                "{} of {of} Gaussians have an opacity outside of 0 to 1. Are they logits, as trained files hold \
                     them? Set \
                 VK_PIPELINE_GAUSSIAN_STATE_CREATE_LOGIT_OPACITY_BIT_GAURAST",
                c.opacity_outside
            ),
        );
    }
    if all >= 16 && c.small_scales == all {
        faults.warning(
            "GAURAST-Draw-scale-twice",
            format!(
                "all of {of} Gaussians have scales of 0 to 1 with LOG_SCALE, so that their standard deviations are 1 \
                     to 2.7: are they \
                 standard deviations already?"
            ),
        );
    }
    if all >= 16 && c.opacity_inside == all {
        faults.warning(
            "GAURAST-Draw-opacity-twice",
            format!(
                "all of {of} Gaussians have opacities of 0 to 1 with LOGIT_OPACITY, so that they are drawn with 0.5 \
                     to 0.73: are they \
                 opacities already?"
            ),
        );
    }
    let is_other_order = c.is_last_axis == all || all >= 16 && c.last_is_greatest * 10 >= all * 9;
    if is_other_order {
        faults.warning(
            "GAURAST-Draw-quaternion-order",
            format!(
                "the last component of the rotation is the greatest in {} of {of} Gaussians: are they x, y, z, w? \
                     The order is w, x, y, z",
                c.last_is_greatest
            ),
        );
    }
    if c.no_scale == all && all >= 16 {
        faults.warning(
            "GAURAST-Draw-zero-scale",
            format!("all of {of} Gaussians have scales of 0: what is seen of them is the low-pass alone"),
        );
    }
    if let Some(what) = c.colors.told() {
        faults.warning(
            "GAURAST-Draw-colors",
            format!(
                "the coefficients of degree 0 of {of} Gaussians are from {} to {}: are they {what}? A colour x from 0 to 1 is \
                 the coefficient (x - 0.5) / 0.28209479",
                c.colors.least, c.colors.greatest
            ),
        );
    }
    if c.seen * SHARE <= c.seen_transposed && c.seen_transposed * 3 >= all * 2 {
        faults.warning(
            "GAURAST-Draw-transposed-rotation",
            format!(
                "{} of {of} Gaussians are in the picture, but {} would be with the transposed rotation: its rows, one after \
                 the other, are the directions right, down and forward of the picture in world space",
                c.seen, c.seen_transposed
            ),
        );
    } else if all >= 16 && c.seen > 0 && c.cut_by_near_plane > c.seen {
        faults.warning(
            "GAURAST-Draw-near-plane",
            format!(
                "{} of the {} Gaussians that are ahead in the picture are before the near plane, and are skipped: is \
                 nearPlane in other units?",
                c.cut_by_near_plane,
                c.cut_by_near_plane + c.seen
            ),
        );
    }
    if all == total
        && let Some(apart) = c.sizes.look_like_variances()
    {
        faults.warning(
            "GAURAST-Draw-variances",
            format!(
                "half of {of} Gaussians are more than {apart:.0} standard deviations from their nearest neighbours, and \
                 would touch them with the square roots of their scales: are these variances?"
            ),
        );
    }
    if c.no_model_opacity == all {
        faults.warning(
            "GAURAST-Draw-model-opacity",
            format!(
                "modelOpacity is 0 for all of {of} Gaussians, so that nothing is drawn: without a factor it is \
                 1, or unused"
            ),
        );
    }
    if faults.0.len() > before || c.drawn > 0 {
        return;
    }
    tell_nothing(draw, counts, &of, faults);
}

/// Tells why nothing is drawn.
fn tell_nothing(draw: &Draw, counts: &Counts, of: &str, faults: &mut Faults) {
    let c = counts;
    let reasons = [
        (
            c.below_floor,
            "GAURAST-Draw-opacity-floor",
            format!("have an opacity below alphaFloor ({})", draw.state.alpha_floor),
        ),
        (c.behind, "GAURAST-Draw-behind-camera", "are behind the camera's near plane".to_owned()),
        (c.beyond, "GAURAST-Draw-beyond-camera", "are beyond the camera's far plane".to_owned()),
        (c.outside, "GAURAST-Draw-outside-picture", "are outside of the picture".to_owned()),
    ];
    let text: Vec<String> = (reasons.iter())
        .filter(|(count, ..)| *count > 0)
        .map(|(count, _, reason)| format!("{count} {reason}"))
        .collect();
    if let Some((count, id, _)) = reasons.iter().max_by_key(|(count, ..)| *count)
        && *count > 0
    {
        let hint = match *id {
            "GAURAST-Draw-opacity-floor" => "",
            _ => {
                ". Camera axes are +x right, +y down, +z forward; the rows of rotation are these directions in the \
                     world"
            }
        };
        faults.warning(id, format!("none of {of} Gaussians is drawn: {}{hint}", text.join(", ")));
    }
}
