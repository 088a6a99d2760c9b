//! The Gaussians of a draw, as its buffers hold them.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use gaurast::vk::{
    GAUSSIAN_LOCATION_UNUSED_GAURAST as UNUSED, GaussianGeometryGAURAST as Geometry,
    PipelineGaussianStateCreateFlagsGAURAST as Flags,
};

use crate::formats::Format;
use crate::recording::{Call, Draw};
use crate::report::Faults;
use crate::rules::pipeline::used_locations;
use crate::rules::ranges;
use crate::rules::reader::Reader;

/// The most Gaussians of a draw that are looked at: the first ones.
const MOST: u64 = 1 << 20;
/// The most bytes of a buffer that are looked at for a draw.
const MOST_BYTES: u64 = 512 << 20;

/// Elements of a vertex buffer, from the first one that a draw reads.
struct Elements {
    bytes: Vec<u8>,
    first: u64,
    stride: u64,
}

/// An attribute, ready to be read.
struct Source {
    format: Format,
    offset: u64,
    /// The number of instances that take the same element, if it advances by instance; 0: all of them.
    divisor: Option<u64>,
    /// The place of its elements among those of all bindings.
    elements: usize,
}

/// The Gaussians of a draw, where the layer can read them.
pub(crate) struct Gaussians {
    /// By location.
    sources: Vec<Option<Source>>,
    elements: Vec<Elements>,
    pub(crate) vertices: Vec<u64>,
    first_instance: u64,
    pub(crate) instances: u64,
    pub(crate) total: u64,
}

impl Gaussians {
    /// The Gaussians of a draw; `None` if the layer can not read them.
    pub(crate) fn of(draw: &Draw, call: Call, reader: &dyn Reader, faults: &mut Faults) -> Option<Self> {
        let (numbers, vertices) = match call {
            Call::Vertices(numbers) => {
                let [first, count, ..] = numbers.map(u64::from);
                (numbers, (first..first + count.min(MOST)).collect::<Vec<_>>())
            }
            Call::Indices(numbers, vertex_offset) => (numbers, indexed(draw, numbers, vertex_offset, reader, faults)?),
            Call::Indirect(..) => return None,
        };
        let [_, count, first_instance, instances] = numbers.map(u64::from);
        let (&low, &high) = (vertices.iter().min()?, vertices.iter().max()?);
        let looked_at = instances.min((MOST / count.max(1)).max(1));
        if looked_at == 0 {
            return None;
        }
        let mut gaussians = Self {
            sources: Vec::new(),
            elements: Vec::new(),
            vertices,
            first_instance,
            instances: looked_at,
            total: count * instances,
        };
        let mut places = BTreeMap::new();
        for (_, location, _) in used_locations(&draw.state, draw.pipeline.decoding.as_ref()) {
            let attribute = draw.pipeline.attributes.get(&location)?;
            let format = Format::of(attribute.format);
            let binding = draw.pipeline.bindings.get(&attribute.binding)?;
            let divisor = binding.by_instance.then_some(u64::from(binding.divisor));
            let range = match divisor {
                Some(divisor) => {
                    let steps = (looked_at - 1).checked_div(divisor);
                    first_instance..=first_instance + steps.unwrap_or(0)
                }
                None => low..=high,
            };
            if !format.is_readable() {
                return None;
            }
            let elements = match places.get(&attribute.binding) {
                Some(&place) => place,
                None => {
                    let elements = read_elements(draw, attribute.binding, range, reader)?;
                    gaussians.elements.push(elements);
                    let place = gaussians.elements.len() - 1;
                    places.insert(attribute.binding, place);
                    place
                }
            };
            let source = Source { format, offset: u64::from(attribute.offset), divisor, elements };
            gaussians.add(location, source)?;
        }
        Some(gaussians)
    }

    /// Adds an attribute; `None` beyond all locations that devices have.
    fn add(&mut self, location: u32, source: Source) -> Option<()> {
        let location = usize::try_from(location).ok().filter(|&location| location < 1024)?;
        if self.sources.len() <= location {
            self.sources.resize_with(location + 1, || None);
        }
        self.sources[location] = Some(source);
        Some(())
    }

    /// An attribute of a Gaussian; `None` beyond its buffer.
    fn attribute(&self, location: u32, vertex: u64, instance: u64) -> Option<[f32; 4]> {
        let source = self.sources.get(location as usize)?.as_ref()?;
        let elements = &self.elements[source.elements];
        let index = match source.divisor {
            Some(divisor) => self.first_instance + instance.checked_div(divisor).unwrap_or(0),
            None => vertex,
        };
        let offset = index.checked_sub(elements.first)? * elements.stride + source.offset;
        source.format.read(&elements.bytes, usize::try_from(offset).ok()?)
    }
}

/// Reads a range of the elements of a vertex buffer: those of vertices or of instances.
fn read_elements(draw: &Draw, number: u32, range: RangeInclusive<u64>, reader: &dyn Reader) -> Option<Elements> {
    let (first, last) = range.into_inner();
    let bound = draw.inputs.vertex_buffers.get(&number)?;
    let binding = draw.pipeline.bindings.get(&number)?;
    let stride = u64::from(bound.stride.unwrap_or(binding.stride));
    let size = reader.size(bound.buffer)?.saturating_sub(bound.offset);
    let size = bound.size.map_or(size, |given| given.min(size));
    let start = (first * stride).min(size);
    let attributes = draw.pipeline.attributes.values().filter(|attribute| attribute.binding == number);
    let ends = attributes.map(|a| u64::from(a.offset) + u64::from(Format::of(a.format).bytes));
    let end = (last * stride + ends.max().unwrap_or(stride)).min(size);
    if end - start > MOST_BYTES {
        return None;
    }
    Some(Elements { bytes: reader.read(bound.buffer, bound.offset + start, end - start)?, first, stride })
}

/// The vertices that indices name.
fn indexed(
    draw: &Draw,
    [first, count, ..]: [u32; 4],
    vertex_offset: i32,
    reader: &dyn Reader,
    faults: &mut Faults,
) -> Option<Vec<u64>> {
    let index = draw.inputs.index_buffer?;
    let bytes = ranges::index_bytes(index.ty);
    let offset = index.offset + u64::from(first) * bytes;
    let has = reader.size(index.buffer)?.saturating_sub(offset) / bytes;
    let read = reader.read(index.buffer, offset, bytes * u64::from(count).min(MOST).min(has))?;
    let vertices: Vec<i64> = (read.chunks_exact(bytes as usize))
        .map(|chunk| {
            let value = chunk.iter().rev().fold(0, |value, &byte| value << 8 | i64::from(byte));
            value + i64::from(vertex_offset)
        })
        .collect();
    let holds = vertices_of(draw, reader)?;
    let beyond = vertices.iter().filter(|&&vertex| vertex < 0 || vertex as u64 >= holds);
    let (beyond, greatest) = (beyond.count(), vertices.iter().max().copied().unwrap_or(0));
    if beyond > 0 {
        faults.warning(
            "GAURAST-Draw-index-past-vertices",
            format!(
                "{beyond} of {} indices name no Gaussian: with the vertex offset the greatest is {greatest}, and the \
                     vertex buffers \
                 hold {holds}",
                vertices.len()
            ),
        );
        return None;
    }
    Some(vertices.into_iter().map(|vertex| vertex as u64).collect())
}

/// The number of vertices that all vertex buffers have.
fn vertices_of(draw: &Draw, reader: &dyn Reader) -> Option<u64> {
    let mut least = u64::MAX;
    for attribute in draw.pipeline.attributes.values() {
        let binding = draw.pipeline.bindings.get(&attribute.binding)?;
        if binding.by_instance {
            continue;
        }
        let bound = draw.inputs.vertex_buffers.get(&attribute.binding)?;
        let stride = u64::from(bound.stride.unwrap_or(binding.stride));
        let size = reader.size(bound.buffer)?.saturating_sub(bound.offset);
        let size = bound.size.map_or(size, |given| given.min(size));
        let element = u64::from(attribute.offset) + u64::from(Format::of(attribute.format).bytes);
        let holds = match size.checked_sub(element) {
            None => 0,
            Some(rest) => rest.checked_div(stride).map_or(u64::MAX, |count| count + 1),
        };
        least = least.min(holds);
    }
    Some(least)
}

/// A Gaussian as it is stored.
pub(crate) struct Gaussian {
    pub(crate) position: [f32; 3],
    pub(crate) scale: [f32; 3],
    pub(crate) rotation: [f32; 4],
    pub(crate) opacity: f32,
    pub(crate) model: Option<[[f32; 4]; 3]>,
    pub(crate) model_opacity: Option<f32>,
    pub(crate) harmonics_are_finite: bool,
    /// The coefficients of degree 0, if they are attributes.
    pub(crate) color: Option<[f32; 3]>,
}

/// A Gaussian of a draw, unless it lies beyond its buffers.
pub(crate) fn fetch(draw: &Draw, gaussians: &Gaussians, vertex: u64, instance: u64) -> Option<Gaussian> {
    let locations = &draw.state.attribute_locations;
    let get = |location: u32| gaussians.attribute(location, vertex, instance);
    let three = |location: u32| get(location).map(|[x, y, z, _]| [x, y, z]);
    let mut scale = three(locations.scale)?;
    if draw.state.geometry == Geometry::GAUSSIAN_2D {
        scale[2] = 0.0;
    }
    let model = if locations.first_model_matrix == UNUSED {
        None
    } else {
        let first = locations.first_model_matrix;
        Some([get(first)?, get(first + 1)?, get(first + 2)?])
    };
    let model_opacity = if locations.model_opacity == UNUSED { None } else { Some(get(locations.model_opacity)?[0]) };
    let in_buffer = draw.state.flags.contains(Flags::SPHERICAL_HARMONICS_BUFFER);
    let coefficients = (draw.state.spherical_harmonics_degree + 1).pow(2);
    let harmonics_are_finite = in_buffer
        || (0..coefficients).all(|k| {
            let triple = three(locations.first_spherical_harmonics + k);
            triple.is_none_or(|triple| triple.iter().all(|value| value.is_finite()))
        });
    Some(Gaussian {
        position: three(locations.position)?,
        scale,
        rotation: get(locations.rotation)?,
        opacity: get(locations.opacity)?[0],
        model,
        model_opacity,
        harmonics_are_finite,
        color: if in_buffer { None } else { three(locations.first_spherical_harmonics) },
    })
}
