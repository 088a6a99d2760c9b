//! The binary64 oracle as an implementation under test, right or with a mistake.

use gaurast_oracle::oracle::Stored;

use crate::draw::Draw;
use crate::implementation::{Error, Implementation};
use crate::judge::expected;
use crate::picture::Picture;
use crate::resolved::Inputs;

/// The oracle.
#[derive(Clone, Copy, Debug)]
pub struct Oracle {
    /// Its name, which is that of its mistake if it makes one.
    pub name: &'static str,
    /// Changes a draw to what an oracle with the mistake draws.
    pub change: fn(&mut Draw),
}

impl Default for Oracle {
    /// The right oracle.
    fn default() -> Self {
        Self { name: "the oracle", change: |_| {} }
    }
}

impl Implementation for Oracle {
    fn name(&self) -> &str {
        self.name
    }

    fn missing(&self, _draw: &Draw) -> Option<&'static str> {
        None
    }

    /// Draws the picture of the binary64 decisions.
    fn draw(&self, draw: &Draw, stored: &Stored) -> Result<Picture, Error> {
        let mut draw = draw.clone();
        (self.change)(&mut draw);
        Ok(match draw.shown {
            Some(shown) => Inputs::of(&draw, shown).picture(),
            None => expected(&draw, stored).picture(),
        })
    }
}
