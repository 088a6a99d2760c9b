//! Mistakes that implementations make, as a test of the cases themselves: the oracle makes one after another, and for each
//! of them some case must fail.
//!
//! A mistaken oracle is an [`Oracle`] that takes another value than the draw has, or that follows another rule than the
//! text's. Its picture is judged as that of a driver is, by the right oracle's envelope. So a pixel whose decisions are free
//! neither catches a mistake nor hides one: it catches it only if no decision gives the mistaken picture.

use std::collections::BTreeMap;

use ash::vk;
use gaurast::vk::{
    GaussianAntialiasingGAURAST as Antialiasing, GaussianCutOffGAURAST as CutOff,
    GaussianLinearizationGAURAST as Linearization, GaussianOrderGAURAST as Order,
};
use gaurast_oracle::oracle::error_model::PrecisionClass;
use gaurast_oracle::oracle::rules::{ColorDirection, FrontOfTies, KeyRounding, MedianHalf, WeighedBy};

use crate::cases::Case;
use crate::draw::Draw;
use crate::oracle::Oracle;
use crate::run::{Expectation, Outcome};

/// A mistake.
#[derive(Debug)]
pub struct Mistake {
    /// A name for tests.
    pub name: &'static str,
    /// A sentence about what an implementation with this mistake does.
    pub text: &'static str,
    /// A chapter of which a case fails.
    pub chapter: &'static str,
    /// Changes a draw to what an implementation with this mistake draws.
    pub make: fn(&mut Draw),
}

/// All mistakes.
pub const MISTAKES: [Mistake; 41] = [
    Mistake {
        name: "pixel_centres",
        text: "Pixel centres are at corners",
        chapter: "topology",
        make: |draw| draw.camera.principal_point = draw.camera.principal_point.map(|c| c + 0.5),
    },
    Mistake {
        name: "no_low_pass",
        text: "The low-pass is left out",
        chapter: "topology",
        make: |draw| draw.state.low_pass_variance = 0.0,
    },
    Mistake {
        name: "no_compensation",
        text: "The opacity is never compensated",
        chapter: "state",
        make: |draw| draw.state.antialiasing = Antialiasing::DILATE,
    },
    Mistake {
        name: "floor_excluded",
        text: "Alphas must be greater than the floor",
        chapter: "state",
        make: |draw| draw.state.alpha_floor = draw.state.alpha_floor.next_up(),
    },
    Mistake {
        name: "no_ceiling",
        text: "Alphas have no ceiling",
        chapter: "state",
        make: |draw| draw.state.alpha_ceiling = 1.0,
    },
    Mistake {
        name: "never_finished",
        text: "No pixel is finished early",
        chapter: "state",
        make: |draw| draw.state.transmittance_floor = 0.0,
    },
    Mistake {
        name: "near_included",
        text: "Gaussians in the near plane are drawn",
        chapter: "camera",
        make: |draw| draw.camera.near_plane = draw.camera.near_plane.next_down(),
    },
    Mistake {
        name: "far_included",
        text: "Gaussians in the far plane are drawn",
        chapter: "camera",
        make: |draw| draw.camera.far_plane = draw.camera.far_plane.next_up(),
    },
    Mistake {
        name: "eye_rounded",
        text: "The eye is rounded to binary32",
        chapter: "numerics",
        make: |draw| draw.camera.eye = draw.camera.eye.map(|c| f64::from(c as f32)),
    },
    Mistake {
        name: "slopes_unclamped",
        text: "Slopes of the Jacobian are not clamped",
        chapter: "camera",
        make: |draw| draw.rules.slope_margin = f64::INFINITY,
    },
    Mistake {
        name: "radial_is_depth",
        text: "The radial distance is taken for the view depth",
        chapter: "order",
        make: |draw| {
            if draw.state.order == Order::RADIAL_DISTANCE {
                draw.state.order = Order::VIEW_DEPTH;
            }
        },
    },
    Mistake {
        name: "one_order",
        text: "Pixels take one order",
        chapter: "order",
        make: |draw| {
            if draw.state.order == Order::PER_PIXEL {
                draw.state.order = Order::VIEW_DEPTH;
            }
        },
    },
    Mistake {
        name: "no_unscented",
        text: "The unscented transform is left out",
        chapter: "unscented",
        make: |draw| draw.state.linearization = Linearization::JACOBIAN,
    },
    Mistake {
        name: "mean_unweighted",
        text: "The mean has no weight in the unscented covariance",
        chapter: "unscented",
        make: |draw| draw.rules.unscented_beta = Some(0.0),
    },
    Mistake {
        name: "default_sigma_points",
        text: "Sigma points are always the default's",
        chapter: "unscented",
        make: |draw| draw.unscented = None,
    },
    Mistake {
        name: "no_distortion",
        text: "No lens distorts",
        chapter: "distortion",
        make: |draw| draw.distortion = None,
    },
    Mistake {
        name: "no_fold",
        text: "Lenses show what lies beyond their fold",
        chapter: "distortion",
        make: |draw| draw.rules.lenses_fold = false,
    },
    Mistake {
        name: "jacobian_is_ideal",
        text: "The Jacobian is that of the ideal lens",
        chapter: "distortion",
        make: |draw| draw.rules.jacobian_is_distorted = false,
    },
    Mistake {
        name: "ties_reversed",
        text: "Of Gaussians with equal keys the last one is in front",
        chapter: "order",
        make: |draw| draw.rules.front_of_ties = FrontOfTies::Last,
    },
    Mistake {
        name: "keys_unrounded",
        text: "Keys have more digits than binary32",
        chapter: "order",
        make: |draw| draw.rules.key_rounding = KeyRounding::Binary64,
    },
    Mistake {
        name: "keys_quantised",
        text: "Keys have 16 bits",
        chapter: "order",
        make: |draw| draw.rules.key_rounding = KeyRounding::UpperHalf,
    },
    Mistake {
        name: "harmonics_reversed",
        text: "Directions of harmonics point to the eye",
        chapter: "harmonics",
        make: |draw| draw.rules.color_direction = ColorDirection::ToEye,
    },
    Mistake {
        name: "no_degree_4",
        text: "Functions of degree 4 are left out",
        chapter: "harmonics",
        make: |draw| draw.degree = draw.degree.min(3),
    },
    Mistake {
        name: "three_sigma_box",
        text: "Gaussians end at three standard deviations, in whole tiles",
        chapter: "topology",
        make: |draw| {
            if draw.footprint.is_none_or(|footprint| footprint.cut_off == CutOff::NONE) {
                *draw = draw.clone().within(CutOff::TILE_RECTANGLE, 3.0);
            }
        },
    },
    Mistake {
        name: "transmittance_after",
        text: "A Gaussian's weight is the transmittance behind it times its alpha",
        chapter: "topology",
        make: |draw| draw.rules.weighed_by = WeighedBy::TransmittanceBehind,
    },
    Mistake {
        name: "last_contributes",
        text: "The Gaussian that ends a pixel contributes",
        chapter: "state",
        make: |draw| draw.rules.last_contributes = true,
    },
    Mistake {
        name: "median_of_other_half",
        text: "The median is the last to contribute at less than a half",
        chapter: "depth",
        make: |draw| draw.rules.median_half = MedianHalf::Lower,
    },
    Mistake {
        name: "stencil_twice",
        text: "Stencil operations run twice",
        chapter: "stencil",
        make: |draw| draw.rules.stencil_repetitions = 2,
    },
    Mistake {
        name: "depth_fail_anywhere",
        text: "A depth that fails runs its stencil operation where nothing reaches",
        chapter: "stencil",
        make: |draw| draw.rules.failures_need_gaussian = false,
    },
    Mistake {
        name: "depth_rounded_down",
        text: "Depths of integer formats are rounded down",
        chapter: "depth",
        make: |draw| draw.rules.depths_round_down = true,
    },
    Mistake {
        name: "parallel_depth_inverse",
        text: "An orthographic depth is taken from 1/z",
        chapter: "depth",
        make: |draw| draw.rules.orthographic_depth_is_linear = false,
    },
    Mistake {
        name: "no_depth_range",
        text: "The viewport's depth range is left out",
        chapter: "depth",
        make: |draw| draw.viewport = Some(draw.viewport().min_depth(0.0).max_depth(1.0)),
    },
    Mistake {
        name: "less_or_equal_for_less",
        text: "Equal depths pass where only smaller ones do",
        chapter: "depth",
        make: |draw| {
            if let Some((op @ vk::CompareOp::LESS, _)) = draw.depth.as_mut().and_then(|depth| depth.test.as_mut()) {
                *op = vk::CompareOp::LESS_OR_EQUAL;
            }
        },
    },
    Mistake {
        name: "no_sample_mask",
        text: "The sample mask is left out",
        chapter: "interactions",
        make: |draw| draw.sample_mask = u32::MAX,
    },
    Mistake {
        name: "quaternion_scalar_last",
        text: "Quaternions are x, y, z, w",
        chapter: "topology",
        make: |draw| draw.scene.rotations.iter_mut().for_each(|quaternion| quaternion.rotate_right(1)),
    },
    Mistake {
        name: "panorama_ends",
        text: "A panorama ends at its edges",
        chapter: "camera",
        make: |draw| draw.rules.panorama_repeats = false,
    },
    Mistake {
        name: "discs_behind_near",
        text: "Discs are met behind the near plane",
        chapter: "surfel",
        make: |draw| draw.rules.discs_begin_at_near = false,
    },
    Mistake {
        name: "directions_of_world",
        text: "Directions of harmonics are the world's, whatever the model matrix",
        chapter: "instances",
        make: |draw| draw.rules.color_direction = ColorDirection::FromEyeInWorld,
    },
    Mistake {
        name: "no_cut_off",
        text: "Nothing is cut off",
        chapter: "footprint",
        make: |draw| *draw = draw.clone().within(CutOff::NONE, 0.0),
    },
    Mistake {
        name: "cut_off_not_in_tiles",
        text: "Cut-offs are ellipses, not tiles",
        chapter: "footprint",
        make: |draw| {
            if let Some(footprint) = draw.footprint.as_mut().filter(|footprint| footprint.cut_off != CutOff::NONE) {
                footprint.cut_off = CutOff::ELLIPSE;
            }
        },
    },
    Mistake {
        name: "no_compensation_floor",
        text: "The compensation of the opacity has no floor",
        chapter: "footprint",
        make: |draw| {
            if let Some(footprint) = &mut draw.footprint {
                footprint.compensation_floor = 0.0;
            }
        },
    },
];

impl Mistake {
    /// Reports whether it is a rounding that the relaxed class of precision grants.
    pub fn is_rounding(&self) -> bool {
        ["eye_rounded", "keys_unrounded"].contains(&self.name)
    }

    /// True if an oracle with this mistake fails the case whose answer is `expectation`.
    pub fn is_caught(&self, expectation: &Expectation) -> bool {
        matches!(expectation.judge(&Oracle { name: self.name, change: self.make }), Outcome::Fail(_))
    }
}

/// The number of cases that catch a mistake, by chapter.
#[derive(Clone, Debug, Default)]
pub struct Catches(BTreeMap<&'static str, usize>);

impl Catches {
    /// Notes that a case of this chapter catches it.
    pub fn add(&mut self, chapter: &'static str) {
        *self.0.entry(chapter).or_default() += 1;
    }

    /// The number of cases of all chapters.
    pub fn all(&self) -> usize {
        self.0.values().sum()
    }

    /// The three chapters with the most cases, and the number of the others.
    fn most(&self) -> String {
        let mut chapters: Vec<_> = self.0.iter().map(|(chapter, count)| (*count, *chapter)).collect();
        chapters.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
        let most: Vec<String> = chapters.iter().take(3).map(|(count, chapter)| format!("{chapter} {count}")).collect();
        match chapters.len() {
            0..=3 => most.join(", "),
            all => format!("{} and {} more", most.join(", "), all - 3),
        }
    }
}

/// The numbers of cases that catch each of [`MISTAKES`], by a class of precision.
///
/// # Errors
/// A sentence if a case fails without a mistake.
pub fn catches(cases: &[Case], precision: PrecisionClass) -> Result<Vec<Catches>, String> {
    let mut all = vec![Catches::default(); MISTAKES.len()];
    for case in cases {
        let Some(draw) = case.draw() else {
            continue;
        };
        let expectation = Expectation::of_draw(draw.held_to(precision));
        if let Outcome::Fail(failure) = expectation.judge(&Oracle::default()) {
            return Err(format!("without a mistake {} fails: {}", case.path(), failure.message));
        }
        for (mistake, catches) in MISTAKES.iter().zip(&mut all) {
            if mistake.is_caught(&expectation) {
                catches.add(case.chapter);
            }
        }
    }
    Ok(all)
}

/// A row for each mistake of the table in `docs/conformance.md`.
pub fn table(catches: &[Catches]) -> String {
    let rows = MISTAKES.iter().zip(catches);
    rows.map(|(mistake, catches)| format!("| {} | {} | {} |\n", mistake.text, catches.all(), catches.most())).collect()
}
