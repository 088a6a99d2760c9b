//! A picture in memory.

/// A drawn picture: premultiplied RGBA pixels, in rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// The number of pixels in a row.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
    /// (C, 1 - T) of each pixel; `width` times `height` of them.
    pub pixels: Vec<[f32; 4]>,
}

impl Picture {
    /// This picture over an opaque background: C + T background, with alpha 1.
    #[must_use]
    pub fn over(mut self, background: [f32; 3]) -> Self {
        for pixel in &mut self.pixels {
            let [r, g, b, alpha] = *pixel;
            let transmittance = 1.0 - alpha;
            let channel = |colour: f32, behind: f32| colour + transmittance * behind;
            *pixel = [channel(r, background[0]), channel(g, background[1]), channel(b, background[2]), 1.0];
        }
        self
    }
}
