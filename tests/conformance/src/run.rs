//! Runs a case on an implementation.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use gaurast_oracle::compare::write_difference;
use gaurast_oracle::oracle::Stored;
use gaurast_oracle::oracle::error_model::PrecisionClass;

use crate::cases::{Case, Subject};
use crate::draw::Draw;
use crate::implementation::Implementation;
use crate::judge::{Expected, expected, stored_before};
use crate::picture::Picture;
use crate::program::Program;
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

/// A case and the contents that its attachments may have afterwards, with which the pictures of any number of implementations
/// are compared.
pub enum Expectation {
    /// That of a draw.
    Draw(Box<Drawing>),
    /// That of a program: the contents by picture.
    Program(Box<Program>, Vec<Expected>),
}

/// A draw, and the contents of its attachments before and after.
pub struct Drawing {
    draw: Draw,
    before: Stored,
    after: After,
}

/// The contents that the attachments may have.
enum After {
    Attachments(Box<Expected>),
    Shown(Box<Inputs>),
}

/// The outcome of a failure without a picture.
fn failed(message: String) -> Outcome {
    Outcome::Fail(Failure { message, picture: None })
}

/// Compares a picture with what is expected.
fn compared(expected: &Expected, picture: Picture) -> Outcome {
    match expected.fault(&picture) {
        None => Outcome::Pass(expected.accuracy(&picture).max_distance),
        Some(message) => Outcome::Fail(Failure { message, picture: Some((Box::new(expected.clone()), picture.color)) }),
    }
}

impl Expectation {
    /// The oracle's answer to a case, which a device of a class of precision must give.
    pub fn new(case: &Case, precision: PrecisionClass) -> Self {
        match case.subject() {
            Subject::Draw(draw) => Self::of_draw(draw.held_to(precision)),
            Subject::Program(program) => {
                let expected = program.expected(precision);
                Self::Program(Box::new(program), expected)
            }
        }
    }

    /// The oracle's answer to a draw.
    pub fn of_draw(draw: Draw) -> Self {
        let before = stored_before(&draw);
        let after = match draw.shown {
            Some(shown) => After::Shown(Box::new(Inputs::of(&draw, shown))),
            None => After::Attachments(Box::new(expected(&draw, &before))),
        };
        Self::Draw(Box::new(Drawing { draw, before, after }))
    }

    /// Lets an implementation draw, and judges the picture.
    pub fn judge(&self, implementation: &dyn Implementation) -> Outcome {
        let judged = catch_unwind(AssertUnwindSafe(|| match self {
            Self::Draw(drawing) => drawing.judge(implementation),
            Self::Program(program, expected) => execute(program, expected, implementation),
        }));
        judged.unwrap_or_else(|panic| failed(format!("the driver refuses: {}", message(&*panic))))
    }
}

impl Drawing {
    fn judge(&self, implementation: &dyn Implementation) -> Outcome {
        let picture = match implementation.draw(&self.draw, &self.before) {
            Ok(picture) => picture,
            Err(error) => return failed(error.0),
        };
        match &self.after {
            After::Shown(inputs) => match inputs.distance(&picture) {
                Ok(distance) => Outcome::Pass(distance),
                Err(message) => failed(message),
            },
            After::Attachments(expected) => compared(expected, picture),
        }
    }
}

/// Lets an implementation execute a program, and judges its pictures.
fn execute(program: &Program, expected: &[Expected], implementation: &dyn Implementation) -> Outcome {
    let Some(gpu) = implementation.vulkan() else {
        return Outcome::NotSupported("Vulkan commands");
    };
    let pictures = match program.execute(gpu) {
        Ok(pictures) => pictures,
        Err(message) => return failed(message),
    };
    if pictures.len() != expected.len() {
        return failed(format!("{} pictures, not {}", pictures.len(), expected.len()));
    }
    let mut farthest = 0.0_f64;
    for (number, (picture, expected)) in pictures.into_iter().zip(expected).enumerate() {
        match compared(expected, picture) {
            Outcome::Pass(distance) => farthest = farthest.max(distance),
            Outcome::Fail(failure) => {
                let message = format!("picture {number}: {}", failure.message);
                return Outcome::Fail(Failure { message, ..failure });
            }
            other => return other,
        }
    }
    Outcome::Pass(farthest)
}

/// The first feature, limit or format that a case needs and an implementation lacks.
pub fn missing(case: &Case, implementation: &dyn Implementation) -> Option<&'static str> {
    match case.subject() {
        Subject::Draw(draw) => implementation.missing(&draw),
        Subject::Program(program) => implementation.missing_for(&program),
    }
}

/// Lets an implementation draw the case, and judges the picture by a class of precision. An unsupported case is not drawn.
pub fn run(case: &Case, implementation: &dyn Implementation, precision: PrecisionClass) -> Outcome {
    match missing(case, implementation) {
        Some(feature) => Outcome::NotSupported(feature),
        None => Expectation::new(case, precision).judge(implementation),
    }
}
