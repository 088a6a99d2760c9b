//! Varyings, and the inputs and outputs of programs that linking keeps.

use gaurast_spirv::{BuiltIn, OutputTarget};
use simdevice::isa::ir::{Constant, Program};
use simdevice::program::interface::VertexOutput;
use std::collections::HashMap;

/// The outputs of a pipeline's programs that have an effect, and the other state that changes linking.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LiveOutputs<'a> {
    /// True for each colour attachment that is written, or whose source's alpha is used.
    pub(crate) color: &'a [bool],
    /// True if alpha may determine coverage.
    pub(crate) coverage_alpha: bool,
    /// True if the second source of blending is read.
    pub(crate) second_source: bool,
    /// True if points are drawn, so that the point size is used.
    pub(crate) points: bool,
    /// True if the pass has views, each of which is a layer.
    pub(crate) views: bool,
}

/// A component of a location.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct InterfaceComponent {
    pub(crate) location: u32,
    pub(crate) component: u32,
}

/// The numbers of varyings.
pub(crate) type Varyings = HashMap<InterfaceComponent, u32>;

/// The meaning of an output of the last stage before rasterization.
pub(super) fn vertex_output(
    target: OutputTarget,
    varyings: &Varyings,
    live_outputs: LiveOutputs<'_>,
) -> Option<VertexOutput> {
    match target {
        OutputTarget::VertexCount => None,
        OutputTarget::Location { location, component, .. } => {
            varyings.get(&InterfaceComponent { location, component }).map(|&index| VertexOutput::Varying(index))
        }
        OutputTarget::BuiltIn { built_in, component } => {
            let component = component as usize;
            match built_in {
                BuiltIn::Position => Some(VertexOutput::Position(component)),
                BuiltIn::PointSize => live_outputs.points.then_some(VertexOutput::PointSize),
                BuiltIn::ClipDistance => Some(VertexOutput::ClipDistance(component)),
                BuiltIn::CullDistance => Some(VertexOutput::CullDistance(component)),
                BuiltIn::Layer => Some(VertexOutput::Layer),
                BuiltIn::ViewportIndex => Some(VertexOutput::ViewportIndex),
                BuiltIn::PrimitiveId => Some(VertexOutput::PrimitiveId),
                _ => None,
            }
        }
    }
}

/// Replaces by a constant zero the inputs without a source. (Slots are indices into `inputs`.)
pub(super) fn zero_inputs<T>(program: &mut Program, inputs: &[Option<T>]) {
    let Program { inputs: registers, constants, .. } = program;
    registers.retain(|input| {
        let is_given = inputs[input.slot as usize].is_some();
        if !is_given {
            constants.push(Constant { reg: input.reg, bits: 0 });
        }
        is_given
    });
}

/// Removes outputs that are never read.
pub(super) fn drop_outputs<T>(program: &mut Program, outputs: &[Option<T>]) {
    program.outputs.retain(|output| outputs[output.slot as usize].is_some());
}
