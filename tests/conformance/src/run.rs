//! Runs a case on an implementation.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use gaurast_oracle::compare::write_difference;
use gaurast_oracle::oracle::Stored;

use crate::cases::Case;
use crate::draw::Draw;
use crate::implementation::Implementation;
use crate::judge::{Expected, expected, stored_before};
use crate::resolved::Inputs;

/// The outcome of a case.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// The picture is correct; the number is its greatest distance from the envelope.
    Pass(f64),
    /// The picture is wrong or drawing failed.
    Fail(Failure),
    /// The device lacks this feature, limit or format.
    NotSupported(&'static str),
}

/// A case that failed.
#[derive(Clone, Debug)]
pub struct Failure {
    /// A description of the error.
    pub message: String,
    /// The expected and the drawn picture, if there is one.
    pub(crate) picture: Option<(Box<Expected>, Vec<[f32; 4]>)>,
}

impl Failure {
    /// Writes a picture of three panels to `path`: expected, drawn, and the distance from the envelope. Returns true if
    /// there is such a picture.
    pub fn write(&self, path: &Path) -> bool {
        self.picture
            .as_ref()
            .is_some_and(|(expected, drawn)| write_difference(path, drawn, &expected.color, expected.distance).is_ok())
    }
}

/// The message of a panic.
fn message(panic: &(dyn std::any::Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("it panics")
}

/// A draw and the contents that its attachments may have afterwards, with which the pictures of any number of implementations
/// are compared.
pub struct Expectation {
    draw: Draw,
    before: Stored,
    after: After,
}

/// The contents that the attachments may have.
enum After {
    Attachments(Box<Expected>),
    Shown(Box<Inputs>),
}

impl Expectation {
    /// The oracle's answer to a draw.
    pub fn new(draw: Draw) -> Self {
        let before = stored_before(&draw);
        let after = match draw.shown {
            Some(shown) => After::Shown(Box::new(Inputs::of(&draw, shown))),
            None => After::Attachments(Box::new(expected(&draw, &before))),
        };
        Self { draw, before, after }
    }

    /// Lets an implementation draw, and judges the picture.
    pub fn judge(&self, implementation: &dyn Implementation) -> Outcome {
        let nothing = |message: String| Outcome::Fail(Failure { message, picture: None });
        let drawn = catch_unwind(AssertUnwindSafe(|| implementation.draw(&self.draw, &self.before)));
        let picture = match drawn {
            Ok(Ok(picture)) => picture,
            Ok(Err(error)) => return nothing(error.0),
            Err(panic) => return nothing(format!("the driver refuses: {}", message(&*panic))),
        };
        match &self.after {
            After::Shown(inputs) => match inputs.distance(&picture) {
                Ok(distance) => Outcome::Pass(distance),
                Err(message) => nothing(message),
            },
            After::Attachments(expected) => match expected.fault(&picture) {
                None => Outcome::Pass(expected.accuracy(&picture).max_distance),
                Some(message) => Outcome::Fail(Failure { message, picture: Some((expected.clone(), picture.color)) }),
            },
        }
    }
}

/// Lets an implementation draw the case, and judges the picture. An unsupported case is not drawn.
pub fn run(case: &Case, implementation: &dyn Implementation) -> Outcome {
    let draw = case.draw();
    match implementation.missing(&draw) {
        Some(feature) => Outcome::NotSupported(feature),
        None => Expectation::new(draw).judge(implementation),
    }
}
