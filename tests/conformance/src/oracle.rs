//! The binary64 oracle as an implementation under test, right or with a mistake.

use gaurast_oracle::oracle::Stored;

use crate::draw::Draw;
use crate::implementation::{Error, Implementation, Picture};
use crate::judge::expected;
use crate::mistakes::Mistake;
use crate::resolved::Inputs;

/// The oracle.
#[derive(Clone, Copy, Debug, Default)]
pub struct Oracle {
    /// The mistake that it makes, if it makes one.
    pub mistake: Option<&'static Mistake>,
}

impl Implementation for Oracle {
    fn name(&self) -> &str {
        self.mistake.map_or("the oracle", |mistake| mistake.name)
    }

    fn missing(&self, _draw: &Draw) -> Option<&'static str> {
        None
    }

    /// Draws the picture of the binary64 decisions.
    fn draw(&self, draw: &Draw, stored: &Stored) -> Result<Picture, Error> {
        let mut draw = draw.clone();
        if let Some(mistake) = self.mistake {
            (mistake.make)(&mut draw);
        }
        Ok(match draw.shown {
            Some(shown) => Inputs::of(&draw, shown).picture(),
            None => expected(&draw, stored).picture(),
        })
    }
}
