//! Accessors: attributes of vertices as floats, and indices.

use super::buffers::Buffers;
use crate::error::{Fault, Place, Reason};

/// The type of an attribute's components: glTF's `componentType`, and true if integers are normalized to fractions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Component {
    pub(super) kind: u32,
    pub(super) normalized: bool,
}

pub(super) const BYTE: u32 = 5120;
pub(super) const UNSIGNED_BYTE: u32 = 5121;
pub(super) const SHORT: u32 = 5122;
pub(super) const UNSIGNED_SHORT: u32 = 5123;
pub(super) const UNSIGNED_INT: u32 = 5125;
pub(super) const FLOAT: u32 = 5126;

impl Component {
    /// Components that are plain integers, or floats.
    pub(super) const fn plain(kind: u32) -> Self {
        Self {
            kind,
            normalized: false,
        }
    }

    /// Components that are integers normalized to fractions.
    pub(super) const fn normalized(kind: u32) -> Self {
        Self {
            kind,
            normalized: true,
        }
    }

    fn size(self) -> usize {
        match self.kind {
            BYTE | UNSIGNED_BYTE => 1,
            SHORT | UNSIGNED_SHORT => 2,
            _ => 4,
        }
    }

    /// Decodes the component that begins `bytes`.
    #[inline]
    fn decode(self, bytes: &[u8]) -> f32 {
        let (value, max) = match self.kind {
            BYTE => (f32::from(bytes[0] as i8), 127.0),
            UNSIGNED_BYTE => (f32::from(bytes[0]), 255.0),
            SHORT => (f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
            UNSIGNED_SHORT => (f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
            _ => {
                let float = f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
                return float;
            }
        };
        if self.normalized {
            (value / max).max(-1.0)
        } else {
            value
        }
    }

    /// The name in messages.
    fn name(self) -> String {
        let kind = match self.kind {
            BYTE => "signed byte",
            UNSIGNED_BYTE => "unsigned byte",
            SHORT => "signed short",
            UNSIGNED_SHORT => "unsigned short",
            UNSIGNED_INT => "unsigned int",
            FLOAT => "float",
            _ => return format!("{}", self.kind),
        };
        if self.normalized {
            format!("{kind} normalized")
        } else {
            kind.to_owned()
        }
    }
}

/// The required type of an attribute.
pub(super) struct Demand {
    /// The number of components of an element: 1 for `SCALAR`, 3 for `VEC3`, 4 for `VEC4`.
    pub(super) width: usize,
    /// The allowed types of its components.
    pub(super) components: &'static [Component],
    /// The allowed types, for messages.
    pub(super) expected: &'static str,
}

/// The values of accessor `index`, element after element. Messages name it `place`.
pub(super) fn values(
    buffers: &mut Buffers<'_>,
    index: usize,
    demand: &Demand,
    place: &str,
) -> Result<Vec<f32>, Fault> {
    decoded(buffers, index, demand, place, Component::decode)
}

/// The indices of accessor `index`. Messages name it `place`.
pub(super) fn indices(
    buffers: &mut Buffers<'_>,
    index: usize,
    place: &str,
) -> Result<Vec<u32>, Fault> {
    const INDEX: Demand = Demand {
        width: 1,
        components: &[
            Component::plain(UNSIGNED_BYTE),
            Component::plain(UNSIGNED_SHORT),
            Component::plain(UNSIGNED_INT),
        ],
        expected: "unsigned byte, short or int",
    };
    decoded(
        buffers,
        index,
        &INDEX,
        place,
        |component, bytes| match component.size() {
            1 => bytes[0].into(),
            2 => u16::from_le_bytes([bytes[0], bytes[1]]).into(),
            _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        },
    )
}

/// The components of accessor `index`, element after element, each decoded by `decode` from the bytes that it begins.
fn decoded<T>(
    buffers: &mut Buffers<'_>,
    index: usize,
    demand: &Demand,
    place: &str,
    decode: impl Fn(Component, &[u8]) -> T,
) -> Result<Vec<T>, Fault> {
    let at = |reason: Reason| reason.at(Place::Part(place.to_owned()));
    let document = buffers.document;
    let accessor = document
        .accessors
        .get(index)
        .ok_or_else(|| at(Reason::Missing))?;
    let shape = match demand.width {
        1 => "SCALAR",
        3 => "VEC3",
        _ => "VEC4",
    };
    if accessor.shape != shape {
        let text = format!("its type is {:?}, not {shape:?}", accessor.shape);
        return Err(at(Reason::Unsupported(text)));
    }
    let component = Component {
        kind: accessor.component_type,
        // For floats, `normalized` has no meaning.
        normalized: accessor.normalized && accessor.component_type != FLOAT,
    };
    if !demand.components.contains(&component) {
        let (found, expected) = (component.name(), demand.expected);
        return Err(at(Reason::Type { found, expected }));
    }
    if accessor.sparse.is_some() {
        let text = "it is sparse, which is not read";
        return Err(at(Reason::Unsupported(text.to_owned())));
    }
    let Some(view) = accessor.buffer_view else {
        let text = "it has no data of its own";
        return Err(at(Reason::Unsupported(text.to_owned())));
    };
    let (bytes, stride) = buffers.view(view, place)?;
    let size = demand.width * component.size();
    let stride = stride.unwrap_or(size);
    let available = bytes.len() as u64;
    let bytes = bytes.get(accessor.byte_offset..).unwrap_or_default();
    let claimed = (accessor.count as u64)
        .saturating_sub(1)
        .saturating_mul(stride as u64)
        .saturating_add(size as u64)
        .saturating_add(accessor.byte_offset as u64);
    if claimed > available || stride < size {
        return Err(at(Reason::TooShort { claimed, available }));
    }
    let len = accessor.count * demand.width;
    let mut values = Vec::new();
    values
        .try_reserve_exact(len)
        .map_err(|_| at(Reason::Memory(4 * len as u64)))?;
    for element in bytes.chunks(stride).take(accessor.count) {
        for c in 0..demand.width {
            values.push(decode(component, &element[c * component.size()..]));
        }
    }
    Ok(values)
}
