//! The outputs of programs that shade vertices.

use crate::limits::MAX_CLIP_CULL_DISTANCES;
use crate::program::interface::{DrawPrograms, FragmentInput, Interpolation, VertexOutput};

/// The slots of the outputs; `None` is not written.
#[derive(Debug, Default)]
pub(crate) struct VertexOutputs {
    pub position: [Option<u32>; 4],
    pub point_size: Option<u32>,
    pub clip: [Option<u32>; MAX_CLIP_CULL_DISTANCES],
    pub cull: [Option<u32>; MAX_CLIP_CULL_DISTANCES],
    pub layer: Option<u32>,
    pub viewport: Option<u32>,
    pub primitive_id: Option<u32>,
    /// The slots, by number of the varying. Only varyings that a later stage may read or that are captured are included.
    pub varyings: Vec<Option<u32>>,
    /// The interpolation of the varyings that the fragment stage reads, by number.
    pub interpolation: Vec<Interpolation>,
}

impl VertexOutputs {
    /// The outputs in some slots, with their meanings by slot. `varyings` is the number of varyings.
    pub(crate) fn new(
        slots: impl Iterator<Item = u32>,
        meanings: &[Option<VertexOutput>],
        varyings: u32,
        programs: &DrawPrograms,
    ) -> Self {
        let mut this = Self {
            varyings: vec![None; varyings as usize],
            interpolation: vec![Interpolation::Flat; programs.varyings_read() as usize],
            ..Self::default()
        };
        let fragment_inputs = programs.fragment.iter().flat_map(|stage| &stage.inputs);
        for input in fragment_inputs.flatten() {
            if let FragmentInput::Varying { index, interpolation, .. } = *input
                && let Some(entry) = this.interpolation.get_mut(index as usize)
            {
                *entry = interpolation;
            }
        }
        for output in slots {
            let Some(meaning) = meanings.get(output as usize) else {
                continue;
            };
            let entry = match *meaning {
                Some(VertexOutput::Position(component)) => this.position.get_mut(component),
                Some(VertexOutput::PointSize) => Some(&mut this.point_size),
                Some(VertexOutput::ClipDistance(index)) => this.clip.get_mut(index),
                Some(VertexOutput::CullDistance(index)) => this.cull.get_mut(index),
                Some(VertexOutput::Layer) => Some(&mut this.layer),
                Some(VertexOutput::ViewportIndex) => Some(&mut this.viewport),
                Some(VertexOutput::PrimitiveId) => Some(&mut this.primitive_id),
                Some(VertexOutput::Varying(index)) => this.varyings.get_mut(index as usize),
                None => None,
            };
            if let Some(entry) = entry {
                *entry = Some(output);
            }
        }
        this
    }

    /// True if vertices have outputs besides position and varyings. The point size counts only if `points`.
    pub(crate) fn has_optional(&self, points: bool) -> bool {
        points && self.point_size.is_some()
            || self.layer.is_some()
            || self.primitive_id.is_some()
            || self.viewport.is_some()
            || self.has_distances()
    }

    /// True if there are clip or cull distances.
    pub(crate) fn has_distances(&self) -> bool {
        self.clip.iter().chain(&self.cull).any(Option::is_some)
    }
}
