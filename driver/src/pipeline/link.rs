//! Linking: the exchange of values between the programs of a pipeline and the device. `link_primitives` links those
//! between the vertex and the fragment program.
//!
//! Stages are matched by location and component. A varying is passed on only if the fragment program reads it: other
//! outputs are removed from the vertex program, so that the device drops the computations for them. A varying that is
//! read but never written is zero. Clip and cull distances that the fragment program reads are passed on as varyings,
//! too, and so are the outputs that transform feedback captures.

use super::link_primitives::{
    self, Given, TessellationShaders, carry_written, components_written, given, gives_memory, output_given,
};
use super::varyings::{InterfaceComponent, LiveOutputs, Varyings, drop_outputs, vertex_output, zero_inputs};
use ash::vk;
use gaurast_spirv::{
    BuiltIn, DepthMode, Input, InputSource, Interface, Interpolation, Output, OutputTarget, Sampling, Shader,
};
use simdevice::isa::ir::Output as ProgramOutput;
use simdevice::program::interface;
use simdevice::program::interface::{
    CapturedOutputs, CapturedValue, DrawPrograms, FragmentInput, FragmentOutput, FragmentPrograms, VertexInput,
    VertexOutput,
};

/// The shaders of a pipeline's stages.
pub(crate) struct StageShaders {
    /// The vertex shader.
    pub(crate) vertex: Shader,
    /// The tessellation shaders.
    pub(crate) tessellation: Option<TessellationShaders>,
    /// The geometry shader.
    pub(crate) geometry: Option<Shader>,
    /// The fragment shader.
    pub(crate) fragment: Option<Shader>,
}

impl StageShaders {
    /// The last shader before rasterization.
    pub(crate) fn last(&self) -> &Shader {
        let evaluation = self.tessellation.as_ref().map(|it| &it.evaluation);
        let last = self.geometry.as_ref().or(evaluation);
        last.unwrap_or(&self.vertex)
    }
}

/// Links programs. `stream` gives the attribute stream of a vertex input's location.
pub(crate) fn link(
    mut shaders: StageShaders,
    stream: impl Fn(u32) -> Option<usize>,
    live_outputs: LiveOutputs<'_>,
) -> DrawPrograms {
    let evaluation = shaders.tessellation.as_mut().map(|it| &mut it.evaluation);
    let last = shaders.geometry.as_mut().or(evaluation);
    let last = last.unwrap_or(&mut shaders.vertex);
    let mut varyings = Varyings::new();
    if let Some(fragment) = &mut shaders.fragment {
        carry_distances(last, fragment);
        varyings = varyings_read(&last.interface, &fragment.interface);
    }
    let read = varyings.len() as u32;
    let captured = carry_captured(last, &mut varyings);
    let StageShaders { vertex, tessellation, geometry, fragment } = shaders;
    // The values that each stage gives to a stage of primitives after it.
    let control = tessellation.as_ref().map(|it| &it.control);
    let next = control.or(geometry.as_ref());
    let of_vertices = next.map(|next| given(&vertex.interface, &next.interface));
    let before = tessellation.as_ref().zip(geometry.as_ref());
    let of_evaluation = before.map(|(it, next)| given(&it.evaluation.interface, &next.interface));
    let output = |target, given: &Option<Given>| match given {
        Some(given) => output_given(target, given),
        None => vertex_output(target, &varyings, live_outputs),
    };
    let programs = vertex_programs(vertex, stream, |target| output(target, &of_vertices));
    let none = Given::new();
    let of_last = of_evaluation.as_ref().or(of_vertices.as_ref());
    DrawPrograms {
        varyings: read,
        captured,
        tessellation: tessellation.map(|shaders| {
            let given = of_vertices.as_ref().unwrap_or(&none);
            link_primitives::tessellation(shaders, given, |target| output(target, &of_evaluation))
        }),
        geometry: geometry
            .map(|shader| link_primitives::geometry(shader, of_last.unwrap_or(&none), &varyings, live_outputs)),
        fragment: fragment.map(|fragment| fragment_programs(fragment, &varyings, live_outputs)),
        ..programs
    }
}

/// Links a vertex program that projects Gaussians: its outputs `components` become varyings, in this order.
pub(crate) fn link_projection(
    vertex: Shader,
    stream: impl Fn(u32) -> Option<usize>,
    components: &[InterfaceComponent],
) -> DrawPrograms {
    let varyings: Varyings = components.iter().copied().zip(0..).collect();
    DrawPrograms {
        varyings: components.len() as u32,
        ..vertex_programs(vertex, stream, |target| vertex_output(target, &varyings, LiveOutputs::default()))
    }
}

/// Replaces the locations of colours by their attachments. `color_locations` has the location of each attachment; it is empty if each
/// attachment's is its number. Alpha to coverage takes the alpha of location 0, wherever that goes.
pub(super) fn place_outputs(fragment: &mut Shader, color_locations: &[u32]) {
    if color_locations.is_empty() {
        return;
    }
    if color_locations[0] != 0 {
        let alpha = OutputTarget::Location { location: 0, component: 3, index: 0 };
        carry(fragment, alpha, InterfaceComponent { location: LOCATION_OF_COVERAGE, component: 3 });
    }
    for output in &mut fragment.interface.outputs {
        if let OutputTarget::Location { location, .. } = &mut output.target
            && *location != LOCATION_OF_COVERAGE
        {
            let attachment = color_locations.iter().position(|of_attachment| *of_attachment == *location);
            *location = attachment.map_or(vk::ATTACHMENT_UNUSED, |attachment| attachment as u32);
        }
    }
}

/// Links a fragment program that computes colours from the accumulated values of Gaussians. `varyings` gives their
/// numbers.
pub(crate) fn link_resolve(fragment: Shader, varyings: &Varyings, live_outputs: LiveOutputs<'_>) -> FragmentPrograms {
    fragment_programs(fragment, varyings, live_outputs)
}

/// The vertex program alone.
fn vertex_programs(
    vertex: Shader,
    stream: impl Fn(u32) -> Option<usize>,
    meaning: impl Fn(OutputTarget) -> Option<VertexOutput>,
) -> DrawPrograms {
    let Shader { program: mut vertex, interface } = vertex;
    let vertex_inputs: Vec<_> = interface.inputs.iter().map(|input| vertex_input(input, &stream)).collect();
    zero_inputs(&mut vertex, &vertex_inputs);
    let vertex_outputs: Vec<_> = interface.outputs.iter().map(|output| meaning(output.target)).collect();
    drop_outputs(&mut vertex, &vertex_outputs);
    DrawPrograms {
        vertex,
        vertex_inputs,
        vertex_outputs,
        varyings: 0,
        captured: None,
        tessellation: None,
        geometry: None,
        fragment: None,
    }
}

fn fragment_programs(fragment: Shader, varyings: &Varyings, live_outputs: LiveOutputs<'_>) -> FragmentPrograms {
    let Shader { mut program, interface } = fragment;
    let inputs: Vec<_> =
        interface.inputs.iter().map(|input| fragment_input(input, varyings, live_outputs.views)).collect();
    zero_inputs(&mut program, &inputs);
    let keeps_depth = interface.depth == DepthMode::NotWritten;
    let outputs: Vec<_> = interface
        .outputs
        .iter()
        .map(|output| fragment_output(output, live_outputs).filter(|it| !(keeps_depth && *it == FragmentOutput::Depth)))
        .collect();
    drop_outputs(&mut program, &outputs);
    FragmentPrograms {
        program,
        inputs,
        outputs,
        early_tests: interface.early_fragment_tests,
        post_depth_coverage: interface.post_depth_coverage,
        discards: interface.discards,
        per_sample: interface.per_sample,
        has_side_effects: interface.has_side_effects,
    }
}

/// The location, which no application can use, for outputs that are captured, each of which is a component.
const LOCATION_OF_CAPTURED: u32 = u32::MAX - 2;

/// The location, which no application can use, for the alpha of alpha to coverage.
const LOCATION_OF_COVERAGE: u32 = u32::MAX - 3;

/// The location, which no application can use, for a distance that is passed on as a varying.
fn location_of_distance(built_in: BuiltIn) -> Option<u32> {
    match built_in {
        BuiltIn::ClipDistance => Some(u32::MAX),
        BuiltIn::CullDistance => Some(u32::MAX - 1),
        _ => None,
    }
}

/// Makes varyings of the distances that the fragment program reads. The outputs of the stage before are unchanged, and
/// are written to varyings as well.
fn carry_distances(vertex: &mut Shader, fragment: &mut Shader) {
    for input in &mut fragment.interface.inputs {
        let InputSource::BuiltIn { built_in, component } = input.source else {
            continue;
        };
        let Some(location) = location_of_distance(built_in) else {
            continue;
        };
        input.source = InputSource::Location {
            location,
            component,
            interpolation: Interpolation::Perspective,
            sampling: Sampling::Center,
        };
        let written = OutputTarget::BuiltIn { built_in, component };
        carry(vertex, written, InterfaceComponent { location, component });
    }
}

/// Makes varyings of the outputs that transform feedback captures. Those that are never written are not captured.
fn carry_captured(last: &mut Shader, varyings: &mut Varyings) -> Option<CapturedOutputs> {
    let feedback = last.interface.transform_feedback.take()?;
    let first = varyings.len() as u32;
    let mut captured = CapturedOutputs::default();
    for (buffer, vertex) in captured.buffers.iter_mut().enumerate() {
        vertex.stride = feedback.strides[buffer];
        vertex.stream = feedback.streams[buffer];
    }
    for scalar in &feedback.scalars {
        let to = InterfaceComponent { location: LOCATION_OF_CAPTURED, component: captured.varyings };
        if carry(last, scalar.target, to).is_some() {
            let value = CapturedValue { offset: scalar.offset, varying: first + captured.varyings };
            varyings.insert(to, value.varying);
            captured.varyings += 1;
            captured.buffers[scalar.buffer as usize].values.push(value);
        }
    }
    Some(captured)
}

/// Writes an output to a component of a location as well. `None` if the stage never writes it.
fn carry(shader: &mut Shader, written: OutputTarget, to: InterfaceComponent) -> Option<()> {
    let InterfaceComponent { location, component } = to;
    let target = OutputTarget::Location { location, component, index: 0 };
    if gives_memory(&shader.interface) {
        return carry_written(&mut shader.interface, written, target);
    }
    let outputs = &mut shader.interface.outputs;
    let slot = outputs.iter().position(|output| output.target == written)?;
    let mut program_outputs = shader.program.outputs.iter();
    let output = program_outputs.find(|output| output.slot as usize == slot)?;
    let output = ProgramOutput { slot: outputs.len() as u32, reg: output.reg };
    shader.program.outputs.push(output);
    outputs.push(Output { target, numeric: outputs[slot].numeric });
    Some(())
}

/// Numbers the components that the vertex stage writes and the fragment stage reads, in order.
fn varyings_read(vertex: &Interface, fragment: &Interface) -> Varyings {
    let mut components: Vec<InterfaceComponent> =
        components_read(fragment).filter(|component| writes(vertex, *component)).collect();
    components.sort_unstable();
    components.dedup();
    components.into_iter().zip(0..).collect()
}

/// The components that the fragment stage reads and the vertex stage doesn't write, in the order of its inputs.
pub(super) fn unwritten(vertex: &Interface, fragment: &Interface) -> Vec<InterfaceComponent> {
    let mut components: Vec<InterfaceComponent> =
        components_read(fragment).filter(|component| !writes(vertex, *component)).collect();
    components.dedup();
    components
}

/// The components of locations that a stage reads.
fn components_read(interface: &Interface) -> impl Iterator<Item = InterfaceComponent> {
    let inputs = interface.inputs.iter();
    inputs.filter_map(|input| match input.source {
        InputSource::Location { location, component, .. } => Some(InterfaceComponent { location, component }),
        InputSource::BuiltIn { .. } | InputSource::Patch => None,
    })
}

/// Reports whether a stage writes a component of a location.
fn writes(interface: &Interface, component: InterfaceComponent) -> bool {
    components_written(interface).any(|written| written == component)
}

fn vertex_input(input: &Input, stream: impl Fn(u32) -> Option<usize>) -> Option<VertexInput> {
    match input.source {
        InputSource::Location { location, component, .. } => {
            Some(VertexInput::Attribute { stream: stream(location)?, component: component as usize })
        }
        InputSource::BuiltIn { built_in, .. } => match built_in {
            BuiltIn::VertexIndex => Some(VertexInput::VertexIndex),
            BuiltIn::InstanceIndex => Some(VertexInput::InstanceIndex),
            BuiltIn::BaseVertex => Some(VertexInput::BaseVertex),
            BuiltIn::BaseInstance => Some(VertexInput::BaseInstance),
            BuiltIn::DrawIndex => Some(VertexInput::DrawIndex),
            BuiltIn::ViewIndex => Some(VertexInput::ViewIndex),
            // A group has only one device, whose index is zero.
            _ => None,
        },
        InputSource::Patch => None,
    }
}

fn fragment_input(input: &Input, varyings: &Varyings, views: bool) -> Option<FragmentInput> {
    match input.source {
        InputSource::Location { location, component, interpolation, sampling } => {
            varyings.get(&InterfaceComponent { location, component }).map(|&index| FragmentInput::Varying {
                index,
                interpolation: match interpolation {
                    Interpolation::Perspective => interface::Interpolation::Perspective,
                    Interpolation::Linear => interface::Interpolation::Linear,
                    Interpolation::Flat => interface::Interpolation::Flat,
                },
                sampling: match sampling {
                    Sampling::Center => interface::Sampling::Center,
                    Sampling::Centroid => interface::Sampling::Centroid,
                    Sampling::Sample => interface::Sampling::Sample,
                },
            })
        }
        InputSource::BuiltIn { built_in, component } => {
            let component = component as usize;
            match built_in {
                BuiltIn::FragCoord => Some(FragmentInput::FragCoord(component)),
                BuiltIn::PointCoord => Some(FragmentInput::PointCoord(component)),
                BuiltIn::FrontFacing => Some(FragmentInput::FrontFacing),
                BuiltIn::PrimitiveId => Some(FragmentInput::PrimitiveId),
                BuiltIn::SampleId => Some(FragmentInput::SampleId),
                BuiltIn::SamplePosition => Some(FragmentInput::SamplePosition(component)),
                // The samples of a pixel fit into the first word.
                BuiltIn::SampleMask if component == 0 => Some(FragmentInput::SampleMask),
                BuiltIn::Layer => Some(FragmentInput::Layer),
                BuiltIn::ViewIndex if views => Some(FragmentInput::Layer),
                BuiltIn::ViewportIndex => Some(FragmentInput::ViewportIndex),
                _ => None,
            }
        }
        InputSource::Patch => None,
    }
}

fn fragment_output(output: &Output, live_outputs: LiveOutputs<'_>) -> Option<FragmentOutput> {
    match output.target {
        OutputTarget::Location { location: LOCATION_OF_COVERAGE, .. } => {
            live_outputs.coverage_alpha.then_some(FragmentOutput::CoverageAlpha)
        }
        OutputTarget::Location { location, component, index } => {
            let has_effect =
                live_outputs.color.get(location as usize) == Some(&true) && (index == 0 || live_outputs.second_source);
            has_effect.then_some(FragmentOutput::Color {
                attachment: location as usize,
                component: component as usize,
                index: index as usize,
            })
        }
        OutputTarget::BuiltIn { built_in, component } => match built_in {
            BuiltIn::FragDepth => Some(FragmentOutput::Depth),
            BuiltIn::SampleMask if component == 0 => Some(FragmentOutput::SampleMask),
            BuiltIn::FragStencilRef => Some(FragmentOutput::StencilReference),
            _ => None,
        },
        OutputTarget::VertexCount => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gaurast_spirv::{PrimitiveModes, ScalarType, Stage, VertexExchange};
    use simdevice::isa::builder::Builder;
    use simdevice::isa::ir::Program;
    use simdevice::isa::ir::Rate;
    use simdevice::isa::ir::Type;

    const FLOAT: ScalarType = ScalarType::Float { width: 32 };

    fn at(location: u32, component: u32) -> Input {
        Input {
            source: InputSource::Location {
                location,
                component,
                interpolation: Interpolation::Linear,
                sampling: Sampling::Center,
            },
            numeric: FLOAT,
        }
    }

    fn to(location: u32, component: u32) -> Output {
        Output { target: OutputTarget::Location { location, component, index: 0 }, numeric: FLOAT }
    }

    fn built_in(built_in: BuiltIn, component: u32) -> Output {
        Output { target: OutputTarget::BuiltIn { built_in, component }, numeric: FLOAT }
    }

    /// A shader that copies its inputs to its outputs; further outputs are zero.
    fn shader(stage: Stage, inputs: Vec<Input>, outputs: Vec<Output>) -> Shader {
        let mut builder = Builder::new();
        let read: Vec<_> = (0..inputs.len() as u32).map(|slot| builder.input(slot, Type::B32, Rate::Varying)).collect();
        for slot in 0..outputs.len() {
            let output = builder.output(slot as u32, Type::B32);
            let value = match read.get(slot) {
                Some(&reg) => reg,
                None => builder.constant(Type::B32, 0),
            };
            builder.assign(output, value);
        }
        Shader {
            program: builder.finish().unwrap(),
            interface: Interface {
                stage,
                inputs,
                outputs,
                descriptors: Vec::new(),
                push_constants: None,
                workgroup_size: [1; 3],
                early_fragment_tests: false,
                post_depth_coverage: false,
                depth: DepthMode::NotWritten,
                discards: false,
                per_sample: false,
                modes: PrimitiveModes::default(),
                exchange: VertexExchange::default(),
                transform_feedback: None,
                has_side_effects: false,
                uses_addresses: false,
            },
        }
    }

    fn stages(vertex: Shader, fragment: Option<Shader>) -> StageShaders {
        StageShaders { vertex, tessellation: None, geometry: None, fragment }
    }

    #[test]
    fn only_what_is_read_is_carried() {
        let vertex = shader(
            Stage::Vertex,
            vec![at(7, 1), at(8, 0)],
            vec![built_in(BuiltIn::Position, 0), to(2, 0), to(0, 3), to(5, 0), built_in(BuiltIn::PointSize, 0)],
        );
        let fragment = shader(Stage::Fragment, vec![at(2, 0), at(9, 0), at(0, 3)], vec![to(0, 0), to(1, 0), to(0, 1)]);
        let live_outputs = LiveOutputs { color: &[true, false], ..LiveOutputs::default() };
        let stream = |location| (location == 7).then_some(3);
        let linked = link(stages(vertex, Some(fragment)), stream, live_outputs);
        assert_eq!(linked.varyings, 2);
        assert_eq!(linked.vertex_inputs, [Some(VertexInput::Attribute { stream: 3, component: 1 }), None]);
        assert_eq!(
            linked.vertex_outputs,
            [
                Some(VertexOutput::Position(0)),
                Some(VertexOutput::Varying(1)),
                Some(VertexOutput::Varying(0)),
                None,
                None
            ]
        );
        let slots = |program: &Program| {
            let inputs: Vec<_> = program.inputs.iter().map(|it| it.slot).collect();
            let outputs: Vec<_> = program.outputs.iter().map(|it| it.slot).collect();
            (inputs, outputs)
        };
        assert_eq!(slots(&linked.vertex), (vec![0], vec![0, 1, 2]));
        let fragment = linked.fragment.unwrap();
        let varying = |index| {
            Some(FragmentInput::Varying {
                index,
                interpolation: interface::Interpolation::Linear,
                sampling: interface::Sampling::Center,
            })
        };
        assert_eq!(fragment.inputs, [varying(1), None, varying(0)]);
        // An input that is never written is replaced by a constant zero.
        assert_eq!(slots(&fragment.program), (vec![0, 2], vec![0, 2]));
        let color = |component| Some(FragmentOutput::Color { attachment: 0, component, index: 0 });
        assert_eq!(fragment.outputs, [color(0), None, color(1)]);
    }

    #[test]
    fn distances_that_are_read_are_carried() {
        let vertex = shader(
            Stage::Vertex,
            vec![],
            vec![
                built_in(BuiltIn::ClipDistance, 0),
                built_in(BuiltIn::ClipDistance, 1),
                built_in(BuiltIn::CullDistance, 0),
            ],
        );
        let read = |built_in, component| Input { source: InputSource::BuiltIn { built_in, component }, numeric: FLOAT };
        let inputs =
            vec![read(BuiltIn::ClipDistance, 1), read(BuiltIn::CullDistance, 0), read(BuiltIn::CullDistance, 3)];
        let fragment = shader(Stage::Fragment, inputs, vec![to(0, 0)]);
        let linked = link(stages(vertex, Some(fragment)), |_| None, LiveOutputs::default());
        assert_eq!(linked.varyings, 2);
        let outputs = [
            VertexOutput::ClipDistance(0),
            VertexOutput::ClipDistance(1),
            VertexOutput::CullDistance(0),
            VertexOutput::Varying(1),
            VertexOutput::Varying(0),
        ];
        assert_eq!(linked.vertex_outputs, outputs.map(Some));
        let registers: Vec<_> = linked.vertex.outputs.iter().map(|it| it.reg).collect();
        assert_eq!((registers[3], registers[4]), (registers[1], registers[2]));
        let varying = |index| {
            Some(FragmentInput::Varying {
                index,
                interpolation: interface::Interpolation::Perspective,
                sampling: interface::Sampling::Center,
            })
        };
        let inputs = linked.fragment.unwrap().inputs;
        assert_eq!(inputs, [varying(1), varying(0), None]);
    }
}
