//! The vertices, indices and instances that a draw reads, beside what its buffers hold.

use std::ops::Range;

use ash::vk;
use gaurast::vk::{GAUSSIAN_LOCATION_UNUSED_GAURAST as UNUSED, PipelineGaussianStateCreateFlagsGAURAST as Flags};

use crate::facts::{Facts, GaussianState};
use crate::formats::Format;
use crate::objects::{Attribute, Pipeline, VertexBinding};
use crate::recording::{Call, Inputs};
use crate::report::Faults;
use crate::rules::state;

/// The inputs of a draw, whose ranges are checked.
pub(crate) struct Ranges<'a> {
    pub(crate) pipeline: &'a Pipeline,
    pub(crate) inputs: &'a Inputs,
    pub(crate) state: &'a GaussianState,
    /// The size of a buffer.
    pub(crate) size: &'a dyn Fn(vk::Buffer) -> Option<u64>,
}

/// Bytes of an index.
pub(crate) fn index_bytes(ty: vk::IndexType) -> u64 {
    match ty {
        vk::IndexType::UINT16 => 2,
        vk::IndexType::UINT8_KHR => 1,
        _ => 4,
    }
}

fn range(first: u32, count: u32) -> Range<u64> {
    u64::from(first)..u64::from(first) + u64::from(count)
}

impl Ranges<'_> {
    /// Checks the numbers of vertices, indices and instances of a draw that has its numbers.
    pub(crate) fn check(&self, call: Call, facts: &Facts, faults: &mut Faults) {
        let [first, count, first_instance, instances] = match call {
            Call::Vertices(numbers) | Call::Indices(numbers, _) => numbers,
            Call::Indirect(_) => return,
        };
        let gaussians = u64::from(count) * u64::from(instances);
        if facts.has_extension && gaussians > facts.max_gaussians_per_draw {
            let most = facts.max_gaussians_per_draw;
            return faults.error(
                "VUID-vkCmdDraw-maxGaussiansPerDraw-90083",
                format!("the draw has {gaussians} Gaussians, but must not have more than {most}"),
            );
        }
        if count == 0 || instances == 0 {
            return;
        }
        if let Call::Indices(..) = call {
            self.check_indices(first, count, faults);
        }
        let vertices = matches!(call, Call::Vertices(_)).then(|| range(first, count));
        let before = faults.0.len();
        self.check_vertices(vertices.clone(), range(first_instance, instances), faults);
        if !state::is_fixed(self.state) {
            return;
        }
        if let Some(vertices) = vertices
            && faults.0.len() == before
        {
            self.check_harmonics(vertices.end - 1, faults);
        }
        self.check_rates(count, instances, faults);
    }

    /// The attribute at a location, and its binding.
    fn attribute(&self, location: u32) -> Option<(&Attribute, &VertexBinding)> {
        let attribute = self.pipeline.attributes.get(&location)?;
        Some((attribute, self.pipeline.bindings.get(&attribute.binding)?))
    }

    /// Warns of Gaussians that are all drawn at one place, since attributes advance by the other rate.
    fn check_rates(&self, count: u32, instances: u32, faults: &mut Faults) {
        let locations = &self.state.attribute_locations;
        let used = [
            locations.position,
            locations.scale,
            locations.rotation,
            locations.opacity,
            locations.first_spherical_harmonics,
            locations.first_model_matrix,
            locations.model_opacity,
        ];
        let by_instance = used.into_iter().filter(|&location| location != UNUSED).any(|location| {
            let attribute = self.attribute(location);
            attribute.is_none_or(|(_, binding)| binding.by_instance)
        });
        if instances > 1 && !by_instance {
            return faults.warning(
                "GAURAST-Draw-instances",
                format!(
                    "the draw has {instances} instances, but no attribute advances by instance: each Gaussian is drawn \
                     {instances} times at one place. Number the Gaussians by vertexCount"
                ),
            );
        }
        let is_of_instance = |location: u32| self.attribute(location).is_some_and(|(_, binding)| binding.by_instance);
        let has_own_matrix = locations.first_model_matrix != UNUSED && !is_of_instance(locations.first_model_matrix);
        if count > 1 && is_of_instance(locations.position) && !has_own_matrix {
            faults.warning(
                "GAURAST-Draw-instance-rate",
                format!(
                    "the draw has {count} vertices, but position advances by instance: all of them are at one place. The \
                     input rate of Gaussians that are vertices is VK_VERTEX_INPUT_RATE_VERTEX"
                ),
            );
        }
    }

    fn check_indices(&self, first: u32, count: u32, faults: &mut Faults) {
        let Some(index) = self.inputs.index_buffer else {
            return;
        };
        let bytes = index_bytes(index.ty);
        let Some(size) = (self.size)(index.buffer) else {
            return;
        };
        let end = (u64::from(first) + u64::from(count)) * bytes;
        let has = size.saturating_sub(index.offset);
        if end > has {
            faults.warning(
                "GAURAST-Draw-indices-past-buffer",
                format!(
                    "the draw reads indices {first} to {}, but the index buffer holds {}",
                    u64::from(first) + u64::from(count) - 1,
                    has / bytes
                ),
            );
        }
    }

    /// Warns of coefficients in a buffer that lie beyond what is bound, and read as zeros.
    fn check_harmonics(&self, last: u64, faults: &mut Faults) {
        let bound = self.inputs.harmonics.filter(|_| self.state.flags.contains(Flags::SPHERICAL_HARMONICS_BUFFER));
        let Some(bound) = bound else { return };
        let bound = bound.harmonics;
        let coefficients = u128::from((self.state.spherical_harmonics_degree.min(16) + 1).pow(2));
        let start =
            u128::from(last) * u128::from(bound.stride) + (coefficients - 1) * u128::from(bound.coefficient_stride);
        let end = start + u128::from(Format::of(bound.format).bytes);
        if end > u128::from(bound.size) {
            faults.warning(
                "GAURAST-Draw-harmonics-past-buffer",
                format!(
                    "coefficient {} of Gaussian {last} ends at byte {end} of the harmonics, but {} bytes are bound: what lies \
                     beyond reads as zeros",
                    coefficients - 1,
                    bound.size
                ),
            );
        }
    }

    /// The end of what is bound, in bytes after the offset.
    fn bound_bytes(&self, binding: u32) -> Option<u64> {
        let bound = self.inputs.vertex_buffers.get(&binding)?;
        let size = (self.size)(bound.buffer)?.saturating_sub(bound.offset);
        Some(bound.size.map_or(size, |given| given.min(size)))
    }

    /// Warns about attributes of vertices and instances that lie beyond their buffers. Both ranges are not empty;
    /// `vertices` is `None` in indexed draws.
    fn check_vertices(&self, vertices: Option<Range<u64>>, instances: Range<u64>, faults: &mut Faults) {
        for (location, attribute) in &self.pipeline.attributes {
            let number = attribute.binding;
            let Some(binding) = self.pipeline.bindings.get(&number) else {
                continue;
            };
            let Some(bytes) = self.bound_bytes(number) else {
                if !self.inputs.vertex_buffers.contains_key(&number) {
                    return faults.warning(
                        "GAURAST-Draw-no-vertex-buffer",
                        format!("location {location} comes from binding {number}, to which no vertex buffer is bound"),
                    );
                }
                continue;
            };
            let stride = self.inputs.vertex_buffers[&number].stride.unwrap_or(binding.stride);
            let (what, first, last) = if binding.by_instance {
                let steps = (instances.end - 1 - instances.start).checked_div(binding.divisor.into()).unwrap_or(0);
                ("instance", instances.start, instances.start + steps)
            } else {
                let Some(vertices) = &vertices else {
                    continue;
                };
                ("vertex", vertices.start, vertices.end - 1)
            };
            let size = u64::from(attribute.offset) + u64::from(Format::of(attribute.format).bytes);
            let end = last * u64::from(stride) + size;
            if end > bytes {
                let holds = if stride == 0 || bytes < size { 0 } else { (bytes - size) / u64::from(stride) + 1 };
                return faults.warning(
                    "GAURAST-Draw-vertices-past-buffer",
                    format!(
                        "the draw reads location {location} of {what} {first} to {last}, but the buffer of binding \
                         {number} holds {holds}"
                    ),
                );
            }
        }
    }
}
