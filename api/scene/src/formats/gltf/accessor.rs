//! Accessors: attributes of vertices as floats, and indices.

use super::buffers::Buffers;
use super::document::Sparse;
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
    decoded(buffers, index, &INDEX, place, decode_index)
}

/// The types of indices.
const INDEX: Demand = Demand {
    width: 1,
    components: &[
        Component::plain(UNSIGNED_BYTE),
        Component::plain(UNSIGNED_SHORT),
        Component::plain(UNSIGNED_INT),
    ],
    expected: "unsigned byte, short or int",
};

/// The index that begins `bytes`.
fn decode_index(component: Component, bytes: &[u8]) -> u32 {
    match component.size() {
        1 => bytes[0].into(),
        2 => u16::from_le_bytes([bytes[0], bytes[1]]).into(),
        _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    }
}

/// The most elements of an accessor without a buffer view, which are zeros. A small file could claim any number.
const MOST_ZEROS: usize = 1 << 24;

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
    let size = demand.width * component.size();
    let len = accessor.count.saturating_mul(demand.width);
    let mut values = Vec::new();
    let reserve = |values: &mut Vec<T>| {
        let reserved = values.try_reserve_exact(len);
        reserved.map_err(|_| at(Reason::Memory(4 * len as u64)))
    };
    match (accessor.buffer_view, &accessor.sparse) {
        (Some(view), _) => {
            let elements = Elements {
                view,
                byte_offset: accessor.byte_offset,
                count: accessor.count,
                size,
            };
            let elements = elements.of(buffers, place)?;
            reserve(&mut values)?;
            for element in elements {
                let parts = element.chunks(component.size()).take(demand.width);
                values.extend(parts.map(|part| decode(component, part)));
            }
        }
        // Elements that are not replaced are zeros.
        (None, Some(_)) if accessor.count <= MOST_ZEROS => {
            reserve(&mut values)?;
            values.extend((0..len).map(|_| decode(component, &[0; 4])));
        }
        (None, Some(_)) => {
            let text = format!("it has more than {MOST_ZEROS} elements without a buffer view");
            return Err(at(Reason::Unsupported(text)));
        }
        (None, None) => {
            let text = "it has no data of its own";
            return Err(at(Reason::Unsupported(text.to_owned())));
        }
    }
    if let Some(sparse) = &accessor.sparse {
        let place = format!("{place}, sparse");
        let replaced = sparse_indices(buffers, sparse, &place)?;
        let elements = Elements {
            view: sparse.values.buffer_view,
            byte_offset: sparse.values.byte_offset,
            count: sparse.count,
            size,
        };
        let elements = elements.of(buffers, &format!("{place}.values"))?;
        for (index, element) in replaced.into_iter().zip(elements) {
            let first = (index as usize).saturating_mul(demand.width);
            let range = first..first.saturating_add(demand.width);
            let Some(values) = values.get_mut(range) else {
                let text = format!("it replaces element {index} of {}", accessor.count);
                return Err(Reason::Unsupported(text).at(Place::Part(format!("{place}.indices"))));
            };
            for (value, part) in values.iter_mut().zip(element.chunks(component.size())) {
                *value = decode(component, part);
            }
        }
    }
    Ok(values)
}

/// The numbers of the elements that `sparse` replaces.
fn sparse_indices(
    buffers: &mut Buffers<'_>,
    sparse: &Sparse,
    place: &str,
) -> Result<Vec<u32>, Fault> {
    let place = format!("{place}.indices");
    let component = Component::plain(sparse.indices.component_type);
    if !INDEX.components.contains(&component) {
        let (found, expected) = (component.name(), INDEX.expected);
        return Err(Reason::Type { found, expected }.at(Place::Part(place)));
    }
    let elements = Elements {
        view: sparse.indices.buffer_view,
        byte_offset: sparse.indices.byte_offset,
        count: sparse.count,
        size: component.size(),
    };
    let elements = elements.of(buffers, &place)?;
    Ok(elements
        .map(|bytes| decode_index(component, bytes))
        .collect())
}

/// Elements in a buffer view.
struct Elements {
    /// The buffer view.
    view: usize,
    /// The first byte in it.
    byte_offset: usize,
    /// The number of elements.
    count: usize,
    /// The bytes of an element.
    size: usize,
}

impl Elements {
    /// The bytes of each element, and of what lies between it and the next. Messages name them `place`.
    fn of<'b>(
        &self,
        buffers: &'b mut Buffers<'_>,
        place: &str,
    ) -> Result<impl Iterator<Item = &'b [u8]> + use<'b>, Fault> {
        let (bytes, stride) = buffers.view(self.view, place)?;
        let stride = stride.unwrap_or(self.size);
        let available = bytes.len() as u64;
        let bytes = bytes.get(self.byte_offset..).unwrap_or_default();
        let claimed = (self.count as u64)
            .saturating_sub(1)
            .saturating_mul(stride as u64)
            .saturating_add(self.size as u64)
            .saturating_add(self.byte_offset as u64);
        if claimed > available || stride < self.size {
            let reason = Reason::TooShort { claimed, available };
            return Err(reason.at(Place::Part(place.to_owned())));
        }
        Ok(bytes.chunks(stride).take(self.count))
    }
}
