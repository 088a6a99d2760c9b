//! What is held against the text.

use gaurast_oracle::oracle::Stored;

use crate::device::Error;
use crate::draw::Draw;

/// Contents of the attachments after a draw.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    /// Colours, row by row; resolved, if there are several samples.
    pub color: Vec<[f32; 4]>,
    /// Depths as numbers of their format and stencils, if they are tested and there is one sample.
    pub stored: Stored,
}

/// An implementation that is held against the text: a driver's device, or anything else that draws.
pub trait Implementation {
    /// Name that it gives itself.
    fn name(&self) -> &str;

    /// The first feature, limit or format that a draw needs and it lacks.
    fn missing(&self, draw: &Draw) -> Option<&'static str>;

    /// Draws, where the depth and stencil attachment holds what is `stored`.
    ///
    /// # Errors
    /// If it fails to.
    fn draw(&self, draw: &Draw, stored: &Stored) -> Result<Picture, Error>;
}
