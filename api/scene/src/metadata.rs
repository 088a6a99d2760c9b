//! The metadata of a scene file: what it states apart from its Gaussians.

use serde::{Deserialize, Serialize};

use crate::axes::FileAxes;

/// The compensation for the filter of 0.3 px^2 that every Gaussian gets on the screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Antialiasing {
    /// None: the filter makes Gaussians larger, as in 3DGS.
    #[default]
    Off,
    /// Reduced opacity, with which Mip-Splatting, gsplat's `antialiased` and Brush's `mip` train.
    Compensated,
}

/// The shape of Gaussians in space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Geometry {
    /// Volumes with three axes, as in 3DGS.
    #[default]
    Volume,
    /// Flat discs with two axes, as in 2DGS; the third scale is 0.
    Surfel,
}

/// The key by which Gaussians are sorted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SortOrder {
    /// The depth of their centres along the view direction, as in 3DGS: `zDepth` of USD.
    #[default]
    Depth,
    /// The distance of their centres from the camera: `cameraDistance` of glTF and USD.
    Distance,
    /// Their depth along each pixel's own ray: no Gaussian pops as the camera turns. `rayHitDistance` of USD.
    PerPixel,
}

/// The colour space of a scene's colours, in which they are blended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub enum ColorSpace {
    /// BT.709 primaries with the sRGB transfer function, as on displays: the colours of 3DGS's training.
    #[default]
    #[serde(rename = "srgb_rec709_display")]
    SrgbRec709Display,
    /// BT.709 primaries, linear.
    #[serde(rename = "lin_rec709_display")]
    LinearRec709Display,
}

/// The metadata of a scene file. A field is None or empty if the file does not state it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Metadata {
    /// The compensation for the screen filter in training.
    pub antialiasing: Option<Antialiasing>,
    /// The shape of its Gaussians.
    pub geometry: Option<Geometry>,
    /// The space of its colours.
    pub color_space: Option<ColorSpace>,
    /// The key by which its Gaussians are to be sorted.
    pub order: Option<SortOrder>,
    /// The axes of the file's coordinates, unless they are the format's without a doubt.
    pub axes: Option<FileAxes>,
    /// Parts of the file that the reader could not take, and without which the picture may be wrong: a sentence each,
    /// without a full stop.
    pub warnings: Vec<String>,
    /// Parts of the file that the reader ignored, and its assumptions: a sentence each, without a full stop.
    pub notes: Vec<String>,
}

impl Metadata {
    /// Merges the metadata of another file, and adds its notes.
    pub(crate) fn join(&mut self, other: Self) {
        fn agree<T: PartialEq>(field: &mut Option<T>, other: Option<T>) -> bool {
            let agreed = *field == other;
            if !agreed {
                *field = None;
            }
            agreed
        }
        let agreed = [
            agree(&mut self.antialiasing, other.antialiasing),
            agree(&mut self.geometry, other.geometry),
            agree(&mut self.color_space, other.color_space),
            agree(&mut self.order, other.order),
        ];
        let what = ["antialiasing", "geometry", "colour space", "order"];
        for (what, _) in what.into_iter().zip(agreed).filter(|(_, agreed)| !agreed) {
            self.note(format!("parts of the scene differ in {what}, and none is told"));
        }
        self.take_messages(&mut Self { notes: other.notes, warnings: other.warnings, ..Self::default() });
    }

    /// Moves the notes and warnings of `other` here.
    pub(crate) fn take_messages(&mut self, other: &mut Self) {
        for note in std::mem::take(&mut other.notes) {
            self.note(note);
        }
        for warning in std::mem::take(&mut other.warnings) {
            self.warn(warning);
        }
    }

    /// Adds a warning, unless it is there already.
    pub(crate) fn warn(&mut self, warning: impl Into<String>) {
        let warning = warning.into();
        if !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
    }

    /// Adds a note, unless it is there already.
    pub(crate) fn note(&mut self, note: impl Into<String>) {
        let note = note.into();
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }
}
