//! A case on an implementation, and what comes of it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use gaurast_oracle::compare::write_difference;

use crate::cases::Case;
use crate::implementation::Implementation;
use crate::judge::{Expected, expected, stored_before};
use crate::resolved;

/// What came of a case.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// The picture is right, and this far from the envelope.
    Pass(f64),
    /// Something is wrong.
    Fail(Failure),
    /// The device lacks this feature, limit or format.
    NotSupported(&'static str),
}

/// A case that failed.
#[derive(Clone, Debug)]
pub struct Failure {
    /// What is wrong.
    pub message: String,
    /// What was expected and what was drawn, if anything was.
    pub(crate) picture: Option<(Box<Expected>, Vec<[f32; 4]>)>,
}

impl Failure {
    /// Writes a picture of three panels, expected, drawn, and how far it is from the envelope, as `path`; returns whether
    /// there is one.
    pub fn write(&self, path: &Path) -> bool {
        self.picture.as_ref().is_some_and(|(expected, drawn)| {
            write_difference(path, drawn, &expected.color, expected.distance).is_ok()
        })
    }
}

/// Has an implementation draw the case, and judges the picture. What it does not support is not drawn.
pub fn run(case: &Case, implementation: &dyn Implementation) -> Outcome {
    let draw = case.draw();
    if let Some(feature) = implementation.missing(&draw) {
        return Outcome::NotSupported(feature);
    }
    let before = stored_before(&draw);
    let nothing = |message: String| {
        Outcome::Fail(Failure {
            message,
            picture: None,
        })
    };
    let drawn = catch_unwind(AssertUnwindSafe(|| implementation.draw(&draw, &before)));
    let picture = match drawn {
        Ok(Ok(picture)) => picture,
        Ok(Err(error)) => return nothing(error.0),
        Err(_) => return nothing("the driver panics".to_owned()),
    };
    if let Some(shown) = draw.shown {
        return match resolved::distance(&draw, shown, &picture) {
            Ok(distance) => Outcome::Pass(distance),
            Err(message) => nothing(message),
        };
    }
    let expected = expected(&draw, &before);
    match expected.fault(&picture) {
        None => Outcome::Pass(expected.verdict(&picture).max_distance),
        Some(message) => Outcome::Fail(Failure {
            message,
            picture: Some((Box::new(expected), picture.color)),
        }),
    }
}
