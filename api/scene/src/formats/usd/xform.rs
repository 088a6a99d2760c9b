//! The transform of a prim: the product of the operations that `xformOpOrder` names.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::layer::{Prim, Value};
use crate::error::{Fault, Place, Reason};

/// The prefix of the operations' attributes.
const PREFIX: &str = "xformOp:";

/// Before the name of an operation that is inverted.
const INVERT: &str = "!invert!";

/// An entry of the order: transforms of prims above have no effect.
const RESET: &str = "!resetXformStack!";

/// A prim's own transform.
pub(super) struct Local {
    /// From the prim to the one above.
    pub(super) map: DAffine3,
    /// True if the transforms of the prims above have no effect.
    pub(super) is_reset: bool,
}

impl Local {
    /// The transform of `prim`.
    pub(super) fn of(prim: &Prim) -> Result<Self, Fault> {
        let mut local = Self { map: DAffine3::IDENTITY, is_reset: false };
        let order = match prim.value("xformOpOrder") {
            None => return Ok(local),
            Some(Value::Texts(order)) => order.as_slice(),
            // An empty array has no type.
            Some(Value::Array(array)) if array.values.is_empty() => &[],
            Some(_) => return Err(wrong(prim, "xformOpOrder", "it is no list of tokens")),
        };
        for entry in order {
            if entry == RESET {
                local = Self { map: DAffine3::IDENTITY, is_reset: true };
                continue;
            }
            let name = entry.strip_prefix(INVERT).unwrap_or(entry);
            let Some(Value::Numbers(numbers)) = prim.value(name) else {
                return Err(wrong(prim, entry, "it is missing, or no number, vector, quaternion or matrix"));
            };
            let Some(map) = operation(name, numbers) else {
                return Err(wrong(prim, entry, "it is not a transform operation, or not of its type"));
            };
            local.map *= if name == entry { map } else { map.inverse() };
        }
        if !local.map.is_finite() || local.map.matrix3.determinant() == 0.0 {
            return Err(wrong(prim, "xformOpOrder", "its transform cannot be inverted"));
        }
        Ok(local)
    }
}

fn wrong(prim: &Prim, attribute: &str, text: &str) -> Fault {
    Reason::Unsupported(text.to_owned()).at(Place::Part(format!("prim {}, {attribute}", prim.path)))
}

/// The map of the operation `name` with a value of `numbers`. None if it is none.
fn operation(name: &str, numbers: &[f64]) -> Option<DAffine3> {
    let kind = name.strip_prefix(PREFIX)?.split(':').next()?;
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let axis = |letter: char| axes.get("XYZ".find(letter)?).copied();
    if let Some(order) = kind.strip_prefix("rotate") {
        // Angles are those about x, y and z, whatever the order; the first letter's rotation comes first.
        let letters: Vec<char> = order.chars().collect();
        let angle = |letter: char| match (letters.len(), numbers) {
            (1, [angle]) => Some(*angle),
            (3, [_, _, _]) => numbers.get("XYZ".find(letter)?).copied(),
            _ => None,
        };
        let mut map = DMat3::IDENTITY;
        for letter in letters.iter().copied() {
            map = DMat3::from_axis_angle(axis(letter)?, angle(letter)?.to_radians()) * map;
        }
        return (!letters.is_empty()).then(|| DAffine3::from_mat3(map));
    }
    let along = |prefix: &str| {
        let letters = kind.strip_prefix(prefix)?;
        let mut letters = letters.chars();
        let direction = axis(letters.next()?)?;
        letters.next().is_none().then_some(direction)
    };
    match (kind, numbers) {
        ("translate", [x, y, z]) => Some(DAffine3::from_translation(DVec3::new(*x, *y, *z))),
        ("scale", [x, y, z]) => Some(DAffine3::from_scale(DVec3::new(*x, *y, *z))),
        ("orient", [w, x, y, z]) => {
            let rotation = DQuat::from_xyzw(*x, *y, *z, *w);
            (rotation.length_squared() > 0.0).then(|| DAffine3::from_quat(rotation.normalize()))
        }
        // Points are rows, which the matrix is multiplied to from the right.
        ("transform", m) if m.len() == 16 => {
            let row = |i: usize| DVec3::from_slice(&m[4 * i..4 * i + 3]);
            Some(DAffine3 { matrix3: DMat3::from_cols(row(0), row(1), row(2)), translation: row(3) })
        }
        (_, [value]) => {
            let translation = along("translate").map(|direction| DAffine3::from_translation(direction * *value));
            translation.or_else(|| {
                let direction = along("scale")?;
                Some(DAffine3::from_scale(DVec3::ONE + direction * (*value - 1.0)))
            })
        }
        _ => None,
    }
}
