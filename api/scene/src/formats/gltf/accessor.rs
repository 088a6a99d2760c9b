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
        Self { kind, normalized: false }
    }

    /// Components that are integers normalized to fractions.
    pub(super) const fn normalized(kind: u32) -> Self {
        Self { kind, normalized: true }
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
        if self.normalized { (value / max).max(-1.0) } else { value }
    }

    /// Decodes the index that begins `bytes`.
    #[inline]
    fn index(self, bytes: &[u8]) -> u32 {
        match self.size() {
            1 => bytes[0].into(),
            2 => u16::from_le_bytes([bytes[0], bytes[1]]).into(),
            _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
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
        if self.normalized { format!("{kind} normalized") } else { kind.to_owned() }
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

/// Indices, of vertices and of elements.
const INDEX: Demand = Demand {
    width: 1,
    components: &[Component::plain(UNSIGNED_BYTE), Component::plain(UNSIGNED_SHORT), Component::plain(UNSIGNED_INT)],
    expected: "unsigned byte, short or int",
};

/// The values of accessor `index`, element after element. Messages name it `place`.
pub(super) fn values(buffers: &mut Buffers<'_>, index: usize, demand: &Demand, place: &str) -> Result<Vec<f32>, Fault> {
    decoded(buffers, index, demand, place, Component::decode)
}

/// The indices of accessor `index`. Messages name it `place`.
pub(super) fn indices(buffers: &mut Buffers<'_>, index: usize, place: &str) -> Result<Vec<u32>, Fault> {
    decoded(buffers, index, &INDEX, place, Component::index)
}

/// The components of accessor `index`, element after element, each decoded by `decode` from the bytes that it begins.
fn decoded<T: Copy + Default>(
    buffers: &mut Buffers<'_>,
    index: usize,
    demand: &Demand,
    place: &str,
    decode: impl Fn(Component, &[u8]) -> T,
) -> Result<Vec<T>, Fault> {
    let at = |reason: Reason| reason.at(Place::Part(place.to_owned()));
    let document = buffers.document;
    let accessor = document.accessors.get(index).ok_or_else(|| at(Reason::Missing))?;
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
    let count = accessor.count;
    let mut values = match accessor.buffer_view {
        Some(view) => {
            let run = Run { view, offset: accessor.byte_offset, count, component, width: demand.width };
            run.decoded(buffers, place, &decode)?
        }
        None => {
            let available = buffers.total_bytes();
            if count as u64 > available {
                let text = format!(
                    "it has no data, and {count} elements of zeros are more than the {available} bytes of all buffers"
                );
                return Err(at(Reason::Unsupported(text)));
            }
            let mut zeros = reserved(count, demand.width).map_err(at)?;
            zeros.resize(count * demand.width, T::default());
            zeros
        }
    };
    if let Some(sparse) = &accessor.sparse {
        let place = format!("{place}, sparse");
        let indices = sparse_indices(buffers, sparse, count, &place)?;
        let run = Run {
            view: sparse.values.buffer_view,
            offset: sparse.values.byte_offset,
            count: sparse.count,
            component,
            width: demand.width,
        };
        let replacing = run.decoded(buffers, &format!("{place}, values"), &decode)?;
        for (index, element) in indices.iter().zip(replacing.chunks_exact(demand.width)) {
            values[index * demand.width..][..demand.width].copy_from_slice(element);
        }
    }
    Ok(values)
}

/// The indices of the elements that `sparse` replaces, each below `count`. Messages name it `place`.
fn sparse_indices(buffers: &mut Buffers<'_>, sparse: &Sparse, count: usize, place: &str) -> Result<Vec<usize>, Fault> {
    let place = format!("{place}, indices");
    let at = |reason: Reason| reason.at(Place::Part(place.clone()));
    let component = Component::plain(sparse.indices.component_type);
    if !INDEX.components.contains(&component) {
        let (found, expected) = (component.name(), INDEX.expected);
        return Err(at(Reason::Type { found, expected }));
    }
    let run = Run {
        view: sparse.indices.buffer_view,
        offset: sparse.indices.byte_offset,
        count: sparse.count,
        component,
        width: 1,
    };
    let indices = run.decoded(buffers, &place, &Component::index)?;
    if let Some(pair) = indices.windows(2).find(|pair| pair[0] >= pair[1]) {
        let text = format!("they must grow, and {} follows {}", pair[1], pair[0]);
        return Err(at(Reason::Unsupported(text)));
    }
    match indices.last() {
        Some(last) if *last as usize >= count => {
            let text = format!("element {last} is not one of the accessor's {count}");
            Err(at(Reason::Unsupported(text)))
        }
        _ => Ok(indices.into_iter().map(|index| index as usize).collect()),
    }
}

/// Elements that follow each other in a buffer view.
struct Run {
    view: usize,
    /// The first element's byte in the view.
    offset: usize,
    /// The number of elements.
    count: usize,
    component: Component,
    /// The components of an element.
    width: usize,
}

impl Run {
    /// The components, element after element, each decoded by `decode` from the bytes that it begins. Messages name the
    /// run `place`.
    fn decoded<T>(
        &self,
        buffers: &mut Buffers<'_>,
        place: &str,
        decode: &impl Fn(Component, &[u8]) -> T,
    ) -> Result<Vec<T>, Fault> {
        let at = |reason: Reason| reason.at(Place::Part(place.to_owned()));
        let (bytes, stride) = buffers.view(self.view, place)?;
        let size = self.width * self.component.size();
        let stride = stride.unwrap_or(size);
        let available = bytes.len() as u64;
        let bytes = bytes.get(self.offset..).unwrap_or_default();
        let claimed = (self.count as u64)
            .saturating_sub(1)
            .saturating_mul(stride as u64)
            .saturating_add(size as u64)
            .saturating_add(self.offset as u64);
        if claimed > available || stride < size {
            return Err(at(Reason::TooShort { claimed, available }));
        }
        let mut values = reserved(self.count, self.width).map_err(at)?;
        for element in bytes.chunks(stride).take(self.count) {
            for c in 0..self.width {
                values.push(decode(self.component, &element[c * self.component.size()..]));
            }
        }
        Ok(values)
    }
}

/// An empty list with memory for `count` elements of `width` components.
fn reserved<T>(count: usize, width: usize) -> Result<Vec<T>, Reason> {
    let mut values = Vec::new();
    let memory = |_| Reason::Memory((count as u64).saturating_mul(4 * width as u64));
    values.try_reserve_exact(count.saturating_mul(width)).map_err(memory)?;
    Ok(values)
}
