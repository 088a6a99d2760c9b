//! What a draw leaves in its attachments.

use gaurast_oracle::oracle::Stored;

/// Contents of the attachments after a draw.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    /// Colours, row by row; resolved if there are several samples.
    pub color: Vec<[f32; 4]>,
    /// Depths, as numbers of their format, and stencils, if they are tested and there is one sample.
    pub stored: Stored,
}
