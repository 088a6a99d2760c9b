//! The directions in which a file's axes point.

use std::fmt;
use std::str::FromStr;

use glam::{DMat3, DVec3};
use serde::{Serialize, Serializer};

/// The directions of axes, with their letters: right, left, up, down, front (away from the viewer) and back.
const DIRECTIONS: [(char, [f64; 3]); 6] = [
    ('r', [1.0, 0.0, 0.0]),
    ('l', [-1.0, 0.0, 0.0]),
    ('d', [0.0, 1.0, 0.0]),
    ('u', [0.0, -1.0, 0.0]),
    ('f', [0.0, 0.0, 1.0]),
    ('b', [0.0, 0.0, -1.0]),
];

/// The directions of a file's axes x, y and z, a letter each: right, left, up, down, front or back, as SPZ's extension
/// names them. `rdf` is the frame of [`Scene`](crate::Scene)s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Axes([char; 3]);

impl Axes {
    /// The axes of the original 3DGS code, and of scenes in memory.
    pub const RIGHT_DOWN_FRONT: Self = Self(['r', 'd', 'f']);
    /// The axes of OpenGL and three.js, which SPZ defines, and as which glTF is read.
    pub const RIGHT_UP_BACK: Self = Self(['r', 'u', 'b']);
    /// The axes that glTF's draft extensions require of SPZ data.
    pub const LEFT_UP_FRONT: Self = Self(['l', 'u', 'f']);
    /// Axes with z upwards.
    pub const RIGHT_FRONT_UP: Self = Self(['r', 'f', 'u']);

    /// The axes with number 1 to 16 of the extension `SPZ_ADOBE_coordinate_system`. The number minus one has three
    /// bits: x points right, the height points up, and the depth's direction. Up to number 8, y is the height and z the
    /// depth, which points to the front if its bit is set; above, z is the height and y the depth, which points to the
    /// back if its bit is set.
    pub(crate) fn of_spz(number: u32) -> Option<Self> {
        let bit = |bit: u32| (number.wrapping_sub(1) >> bit) & 1 == 1;
        let right = if bit(0) { 'r' } else { 'l' };
        let height = if bit(1) { 'u' } else { 'd' };
        match number {
            1..=8 => Some(Self([right, height, if bit(2) { 'f' } else { 'b' }])),
            9..=16 => Some(Self([right, if bit(2) { 'b' } else { 'f' }, height])),
            _ => None,
        }
    }

    /// The axes of a file whose vertical axis is `text`, x or z, which points upwards unless it has a minus sign. They are of
    /// right hands. With y, whose sign programs leave open, they are those of 3DGS. None if it is another text.
    pub(crate) fn with_vertical(text: &str) -> Option<Self> {
        match text.trim().to_ascii_lowercase().as_str() {
            "x" | "+x" => Some(Self(['u', 'l', 'b'])),
            "-x" => Some(Self(['d', 'r', 'b'])),
            "y" | "-y" => Some(Self::RIGHT_DOWN_FRONT),
            "z" | "+z" => Some(Self::RIGHT_FRONT_UP),
            "-z" => Some(Self(['r', 'b', 'd'])),
            _ => None,
        }
    }

    /// The matrix from these axes to those of scenes.
    pub fn matrix(self) -> DMat3 {
        let [x, y, z] = self.0.map(direction);
        DMat3::from_cols(x, y, z)
    }

    /// Returns true if the axes are of the other handedness than a scene's, so that a scene is mirrored when it is read.
    pub fn is_mirrored(self) -> bool {
        self.matrix().determinant() < 0.0
    }
}

fn direction(letter: char) -> DVec3 {
    let known = DIRECTIONS.iter().find(|(known, _)| *known == letter);
    known.map_or(DVec3::ZERO, |(_, direction)| DVec3::from_array(*direction))
}

impl FromStr for Axes {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong =
            "axes are three letters, one of right and left, one of up and down, one of front and back, such as rub";
        let letters: Vec<char> = text.chars().map(|letter| letter.to_ascii_lowercase()).collect();
        let axes = Self(letters.try_into().map_err(|_| wrong)?);
        if axes.matrix().determinant().abs() == 1.0 { Ok(axes) } else { Err(wrong) }
    }
}

impl fmt::Display for Axes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|letter| write!(f, "{letter}"))
    }
}

impl Serialize for Axes {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// The reason for which a file's axes are taken to be what they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum AxesReason {
    /// The caller names them.
    Given,
    /// The file names them.
    File,
    /// The scene's ground is at this end.
    Ground,
    /// They are the format's.
    Format,
}

/// The axes of a file, and why they are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct FileAxes {
    /// The axes.
    pub axes: Axes,
    /// The reason.
    pub reason: AxesReason,
    /// True if the file's coordinates are those of its cameras, so that camera files are turned with it. False of
    /// formats with axes of their own: reading them restores the frame of the cameras.
    pub of_cameras: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_are_directions() {
        for (text, mirrored) in [("rdf", false), ("RUB", false), ("luf", false), ("rfu", false), ("ruf", true)] {
            let axes: Axes = text.parse().expect(text);
            assert_eq!((axes.to_string(), axes.is_mirrored()), (text.to_ascii_lowercase(), mirrored));
        }
        assert_eq!(Axes::RIGHT_DOWN_FRONT.matrix(), DMat3::IDENTITY);
        // With z upwards, (1, 2, 3) is 1 to the right, 2 ahead, and 3 above.
        assert_eq!(Axes::RIGHT_FRONT_UP.matrix() * DVec3::new(1.0, 2.0, 3.0), DVec3::new(1.0, -3.0, 2.0));
        for bad in ["", "rd", "rdfb", "rrf", "rlf", "xyz", "udf"] {
            assert!(bad.parse::<Axes>().is_err(), "{bad}");
        }
    }

    #[test]
    fn a_vertical_axis_keeps_hands() {
        for (text, up) in [
            ("x", DVec3::X),
            ("-x", DVec3::NEG_X),
            ("Y", DVec3::NEG_Y),
            ("-y", DVec3::NEG_Y),
            (" z ", DVec3::Z),
            ("+z", DVec3::Z),
            ("-z", DVec3::NEG_Z),
        ] {
            let axes = Axes::with_vertical(text).expect(text);
            assert!(!axes.is_mirrored(), "{text}");
            assert_eq!(axes.matrix() * up, DVec3::NEG_Y, "{text}");
        }
        assert_eq!(Axes::with_vertical("up"), None);
    }
}
