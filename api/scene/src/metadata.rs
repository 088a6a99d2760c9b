//! What a scene file says of itself, apart from its Gaussians.

use serde::Serialize;

/// How the filter of 0.3 px^2 is paid for that every Gaussian gets on the screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Antialiasing {
    /// Not at all: Gaussians get larger, as 3DGS has it.
    #[default]
    Off,
    /// By opacity: what Mip-Splatting, gsplat's `antialiased` and Brush's `mip` are trained with.
    Compensated,
}

/// What Gaussians are in space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Geometry {
    /// Volumes with three axes, as of 3DGS.
    #[default]
    Volume,
    /// Flat discs with two, as of 2DGS; the third scale is 0.
    Surfel,
}

/// What Gaussians are sorted by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SortOrder {
    /// Their centres' depth along the view direction, as 3DGS does.
    #[default]
    Depth,
    /// Their centres' distance from the camera: `cameraDistance` of glTF.
    Distance,
}

/// The colour space that a scene's colours are in, and are blended in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub enum ColorSpace {
    /// BT.709's primaries with sRGB's transfer function, as pictures are shown: what 3DGS is trained on.
    #[default]
    #[serde(rename = "srgb_rec709_display")]
    SrgbRec709Display,
    /// BT.709's primaries, linear.
    #[serde(rename = "lin_rec709_display")]
    LinearRec709Display,
}

/// What a scene file says of itself. Nothing is `None` or empty by default: the file says nothing.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Metadata {
    /// How its Gaussians were filtered when they were trained.
    pub antialiasing: Option<Antialiasing>,
    /// What its Gaussians are.
    pub geometry: Option<Geometry>,
    /// What its colours are.
    pub color_space: Option<ColorSpace>,
    /// What its Gaussians are to be sorted by.
    pub order: Option<SortOrder>,
    /// What the reader passed over or had to assume, a sentence each without a full stop.
    pub notes: Vec<String>,
}

impl Metadata {
    /// Keeps what `other` says too, and adds its notes.
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
            self.note(format!(
                "parts of the scene differ in {what}, and none is told"
            ));
        }
        for note in other.notes {
            self.note(note);
        }
    }

    /// Adds a note, once.
    pub(crate) fn note(&mut self, note: impl Into<String>) {
        let note = note.into();
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }
}
