//! The accuracy contract: an image keeps its limits or does not.

use std::fmt;
use std::path::Path;

use super::distance::{distance_between, distance_from_envelope, took_other_branch};
use super::picture::write_difference;
use crate::oracle::Reference;

/// The limits that an image must not exceed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Greatest distance from the envelope, in any channel of any pixel.
    pub distance: f64,
    /// Share of pixels that match another outcome than the binary64 one.
    pub other_branch: f64,
    /// Share of pixels that the reference calls undecidable.
    pub undecidable: f64,
}

impl Limits {
    /// The contract for trained scenes at ordinary sizes.
    pub const CONTRACT: Self = Self { distance: 5e-6, other_branch: 0.0002, undecidable: 0.01 };

    /// The contract's distance without limits on shares of pixels. It serves scenes that are made to be difficult, and
    /// scenes too small for shares to be significant. No pixel is excluded, but any number may be undecidable.
    pub const ENVELOPE_ONLY: Self = Self { other_branch: 1.0, undecidable: 1.0, ..Self::CONTRACT };
}

/// The accuracy of an image, measured against a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accuracy {
    /// The limits that it is held to.
    pub limits: Limits,
    /// Pixels of the image.
    pub pixels: usize,
    /// Greatest distance of a channel from the hull of the pixel's outcomes; infinite if a channel
    /// is not a number.
    pub max_distance: f64,
    /// The pixel (x, y) where that is.
    pub worst_pixel: [u32; 2],
    /// Pixels further from the envelope than the limit.
    pub outside: usize,
    /// Pixels within the envelope that differ from the binary64 result.
    pub other_branch: usize,
    /// Pixels of `other_branch` that match no single outcome and lie between two.
    pub between_branches: usize,
    /// Pixels that the reference calls undecidable.
    pub undecidable: usize,
    /// Undecidable pixels for which the reference stopped before it had followed every branch.
    pub exhausted: usize,
}

impl Accuracy {
    /// The accuracy of `image`, which has as many pixels as `reference`.
    pub fn of(image: &[[f32; 4]], reference: &Reference, limits: Limits) -> Self {
        assert_eq!(image.len(), reference.nominal.len(), "the sizes differ");
        let mut accuracy = Self {
            limits,
            pixels: image.len(),
            max_distance: 0.0,
            worst_pixel: [0, 0],
            outside: 0,
            other_branch: 0,
            between_branches: 0,
            undecidable: reference.alternatives.len(),
            exhausted: reference.exhausted,
        };
        for (index, rgba) in image.iter().enumerate() {
            let distance = distance_from_envelope(*rgba, reference, index);
            if distance > accuracy.max_distance {
                accuracy.max_distance = distance;
                let index = index as u32;
                accuracy.worst_pixel = [index % reference.width, index / reference.width];
            }
            if distance > limits.distance {
                accuracy.outside += 1;
            } else if took_other_branch(*rgba, reference, index, limits.distance) {
                accuracy.other_branch += 1;
                let matches = |outcome: &[f64; 4]| distance_between(*rgba, *outcome) <= limits.distance;
                if !reference.outcomes(index).any(matches) {
                    accuracy.between_branches += 1;
                }
            }
        }
        accuracy
    }

    /// True if the image keeps all limits.
    pub fn holds(&self) -> bool {
        let share = |count: usize| count as f64 / self.pixels as f64;
        self.outside == 0
            && share(self.other_branch) <= self.limits.other_branch
            && share(self.undecidable) <= self.limits.undecidable
    }
}

impl fmt::Display for Accuracy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |count: usize| 100.0 * count as f64 / self.pixels as f64;
        let [x, y] = self.worst_pixel;
        write!(
            f,
            "{}: {:.2e} from the envelope at most, at ({x}, {y}) (limit {:.0e}); {} of {} pixels \
             outside; {} ({:.4} %) took another branch (limit {} %), {} of them between branches; \
             {} ({:.4} %) undecidable (limit {} %), {} of them exhausted",
            if self.holds() { "holds" } else { "fails" },
            self.max_distance,
            self.limits.distance,
            self.outside,
            self.pixels,
            self.other_branch,
            percent(self.other_branch),
            100.0 * self.limits.other_branch,
            self.between_branches,
            self.undecidable,
            percent(self.undecidable),
            100.0 * self.limits.undecidable,
            self.exhausted,
        )
    }
}

/// Panics with the accuracy unless the image keeps the limits, and leaves a picture of the
/// difference in `target/differences/<name>.png`.
#[track_caller]
pub fn assert_contract(name: &str, image: &[[f32; 4]], reference: &Reference, limits: Limits) -> Accuracy {
    let accuracy = Accuracy::of(image, reference, limits);
    if !accuracy.holds() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/differences").join(format!("{name}.png"));
        let picture = match write_difference(&path, image, reference, limits.distance) {
            Ok(()) => format!("see {}", path.display()),
            Err(error) => format!("no picture: {error}"),
        };
        panic!("{name} {accuracy}; {picture}");
    }
    accuracy
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oracle::SkipCounts;
    use std::collections::BTreeMap;

    /// 100 x 100 pixels of 0.5, pixel 7 undecidable between 0.5 and 0.25.
    fn reference() -> Reference {
        Reference {
            width: 100,
            height: 100,
            nominal: vec![[0.5; 4]; 10_000],
            alternatives: BTreeMap::from([(7, vec![[0.25, 0.5, 0.25, 0.25]])]),
            slack: vec![0.0; 10_000],
            exhausted: 0,
            skips: SkipCounts::default(),
            undecidable_keys: 0,
        }
    }

    #[test]
    fn the_same_image_holds() {
        let reference = reference();
        let accuracy = Accuracy::of(&reference.to_f32(), &reference, Limits::CONTRACT);
        assert!(accuracy.holds(), "{accuracy}");
        assert_eq!((accuracy.max_distance, accuracy.outside), (0.0, 0));
        assert_eq!((accuracy.other_branch, accuracy.undecidable), (0, 1));
    }

    #[test]
    fn the_limit_is_5e_6_outside_the_envelope() {
        let reference = reference();
        for (value, holds) in [(0.500004, true), (0.500006, false), (0.499994, false), (f32::NAN, false)] {
            let mut image = reference.to_f32();
            image[123][2] = value;
            let accuracy = Accuracy::of(&image, &reference, Limits::CONTRACT);
            assert_eq!(accuracy.holds(), holds, "{accuracy}");
            assert_eq!(accuracy.worst_pixel, [23, 1]);
            assert_eq!(accuracy.outside, usize::from(!holds));
        }
    }

    #[test]
    fn other_branches_are_accepted_and_counted() {
        let reference = reference();
        for (rgba, between) in [([0.25, 0.5, 0.25, 0.25], 0), ([0.4, 0.5, 0.4, 0.4], 1)] {
            let mut image = reference.to_f32();
            image[7] = rgba;
            let accuracy = Accuracy::of(&image, &reference, Limits::CONTRACT);
            assert!(accuracy.holds(), "{accuracy}");
            assert_eq!((accuracy.other_branch, accuracy.between_branches), (1, between));
        }
        let mut image = reference.to_f32();
        image[7] = [0.2; 4];
        assert!(!Accuracy::of(&image, &reference, Limits::ENVELOPE_ONLY).holds());
    }

    #[test]
    fn too_many_branches_fail() {
        let mut reference = reference();
        for index in 0..101 {
            reference.alternatives.insert(index, vec![[0.25; 4]]);
        }
        // 1.01 % undecidable.
        let image = reference.to_f32();
        assert!(!Accuracy::of(&image, &reference, Limits::CONTRACT).holds());
        assert!(Accuracy::of(&image, &reference, Limits::ENVELOPE_ONLY).holds());
        // 0.03 % on another branch.
        reference.alternatives.retain(|&index, _| index < 50);
        let mut image = reference.to_f32();
        image[10..13].fill([0.25; 4]);
        let accuracy = Accuracy::of(&image, &reference, Limits::CONTRACT);
        assert_eq!(accuracy.other_branch, 3);
        assert!(!accuracy.holds());
    }

    #[test]
    #[should_panic(expected = "fails")]
    fn assert_contract_panics_with_the_accuracy() {
        let reference = reference();
        let mut image = reference.to_f32();
        image[0][0] = 1.0;
        assert_contract("assert_contract_panics", &image, &reference, Limits::CONTRACT);
    }
}
