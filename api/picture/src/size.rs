//! Sizes of pictures as text.

use std::str::FromStr;

/// The greatest width and height of a picture.
const MAX_SIDE: u32 = 16_384;

/// A picture's width and height.
#[derive(Clone, Copy, Debug)]
pub struct Size(pub [u32; 2]);

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (width, height) = text.split_once(['x', 'X']).ok_or("a width and a height are needed, such as 1280x720")?;
        let side = |word: &str| {
            word.parse()
                .ok()
                .filter(|side| (1..=MAX_SIDE).contains(side))
                .ok_or(format!("each side is 1 to {MAX_SIDE} pixels"))
        };
        Ok(Self([side(width)?, side(height)?]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!("640x480".parse::<Size>().map(|s| s.0), Ok([640, 480]));
        for bad in ["640", "0x1", "1x", "16385x1", "-1x1", "1x99999999999"] {
            assert!(bad.parse::<Size>().is_err(), "{bad}");
        }
    }
}
