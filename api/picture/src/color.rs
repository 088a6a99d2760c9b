//! Backgrounds of pictures, and their names.

use std::str::FromStr;

/// The background of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Background {
    /// An opaque colour: red, green and blue, each 0 to 1, with the sRGB transfer function.
    Color([f32; 3]),
    /// No background: the picture stays transparent.
    Transparent,
}

impl Background {
    /// The background's colour; black if transparent.
    pub fn color(self) -> [f32; 3] {
        match self {
            Self::Color(color) => color,
            Self::Transparent => [0.0; 3],
        }
    }
}

/// The named colours: CSS's basic ones.
const NAMES: [(&str, [u8; 3]); 20] = [
    ("black", [0, 0, 0]),
    ("silver", [192, 192, 192]),
    ("gray", [128, 128, 128]),
    ("grey", [128, 128, 128]),
    ("white", [255, 255, 255]),
    ("maroon", [128, 0, 0]),
    ("red", [255, 0, 0]),
    ("purple", [128, 0, 128]),
    ("magenta", [255, 0, 255]),
    ("fuchsia", [255, 0, 255]),
    ("green", [0, 128, 0]),
    ("lime", [0, 255, 0]),
    ("olive", [128, 128, 0]),
    ("yellow", [255, 255, 0]),
    ("navy", [0, 0, 128]),
    ("blue", [0, 0, 255]),
    ("cyan", [0, 255, 255]),
    ("aqua", [0, 255, 255]),
    ("teal", [0, 128, 128]),
    ("orange", [255, 165, 0]),
];

impl FromStr for Background {
    type Err = &'static str;

    /// Parses `transparent`, a name, `#rgb`, `#rrggbb`, or three finite numbers with commas between them.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let lower = text.trim().to_ascii_lowercase();
        if lower == "transparent" {
            return Ok(Self::Transparent);
        }
        let of_bytes = |bytes: [u8; 3]| Self::Color(bytes.map(|byte| f32::from(byte) / 255.0));
        if let Some((_, bytes)) = NAMES.iter().find(|(name, _)| *name == lower) {
            return Ok(of_bytes(*bytes));
        }
        if let Some(bytes) = lower.strip_prefix('#').and_then(hexadecimal) {
            return Ok(of_bytes(bytes));
        }
        let numbers: Option<Vec<f32>> =
            lower.split(',').map(|word| word.trim().parse().ok().filter(|x: &f32| x.is_finite())).collect();
        numbers.and_then(|numbers| numbers.try_into().ok()).map(Self::Color).ok_or(
            "a colour is transparent, one of CSS's basic names such as white, #rgb, #rrggbb, or three numbers with \
                 commas between them, each 0 to 1",
        )
    }
}

/// The bytes of `rgb` or `rrggbb`.
fn hexadecimal(digits: &str) -> Option<[u8; 3]> {
    let digits: Vec<u8> =
        digits.chars().map(|digit| digit.to_digit(16).map(|digit| digit as u8)).collect::<Option<_>>()?;
    match digits[..] {
        [r, g, b] => Some([r, g, b].map(|digit| 17 * digit)),
        [r, rr, g, gg, b, bb] => Some([16 * r + rr, 16 * g + gg, 16 * b + bb]),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_understood_or_refused() {
        let color = |text: &str| text.parse::<Background>();
        assert_eq!(color("transparent"), Ok(Background::Transparent));
        for white in ["white", "White", "#fff", "#FFFFFF", "1,1,1", "1, 1, 1"] {
            assert_eq!(color(white), Ok(Background::Color([1.0; 3])), "{white}");
        }
        assert_eq!(color("#0f8"), color("#00ff88"));
        assert_eq!(color("teal"), color("#008080"));
        assert_eq!(color("0,0.5,-1"), Ok(Background::Color([0.0, 0.5, -1.0])));
        for bad in ["", "whitish", "#ff", "#ggg", "1,1", "1,1,nan", "1,1,1,1", "#+1+1+1"] {
            assert!(color(bad).is_err(), "{bad}");
        }
    }
}
