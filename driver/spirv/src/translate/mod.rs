//! Translation of SPIR-V to the device's IR.
//!
//! A function's blocks first become a tree of constructs ([`structurize`]); then the tree is walked ([`control_flow`])
//! and each instruction becomes scalar ones ([`instruction`]). Calls are inlined. Variables of a function, `Private`
//! variables, inputs and outputs are not stored to by instructions of the IR: a store only records the registers that
//! hold the variable from then on, and where control flow joins, a variable that differs becomes a variable of the IR
//! ([`promoted`]). Variables with arrays that are indexed at run time are in per-lane memory instead.
//!
//! All sizes are bounded: scalars of a value, nesting, calls, and emitted instructions.

mod analysis;
mod atomic;
mod composite;
mod control_flow;
mod descriptors;
mod elementwise;
mod emitter;
mod glsl;
mod image;
mod inputs_outputs;
mod instruction;
mod integer_dot;
mod interpolation;
mod memory;
mod options;
mod pointer;
mod pointer_value;
mod promoted;
mod structurize;
mod subgroup;
mod transform_feedback;
mod translator;
mod value;
mod variables;
mod vertex_memory;
mod vertex_places;

use std::collections::HashMap;

use isa::ir::{MAX_LANES, Program};
use spirv::{
    AddressingModel, BuiltIn, Capability, ExecutionMode, ExecutionModel, FPFastMathMode, MemoryModel, StorageClass,
};

use crate::error::{Diagnostic, Error, Result, malformed, unsupported};
use crate::globals::{Globals, Specialization};
use crate::instruction::Instruction;
use crate::interface::{
    DepthMode, Domain, InputPrimitive, Interface, OutputPrimitive, PrimitiveModes, Shader, Spacing, Stage,
    TransformFeedback, VertexExchange,
};
use crate::module::Module;
use crate::types::Scalar;
use analysis::Analysis;
use control_flow::ControlFlow;
use emitter::Emitter;
use inputs_outputs::InputsOutputs;
use promoted::PromotedVariables;
use translator::Translator;
use vertex_places::VertexPlaces;

pub use options::Options;

/// The size of the stack of the translating thread.
const STACK_BYTES: usize = 16 << 20;

/// Translates an entry point.
///
/// The translation runs on a thread of its own, whose stack is large enough for all allowed nesting, whatever the
/// application's stack is.
///
/// # Errors
/// [`Error`] names what is malformed, unsupported or too large.
pub fn translate(
    module: &Module,
    name: &str,
    stage: Stage,
    specialization: &Specialization,
    options: &Options,
) -> Result<Shader, Error> {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().name("gaurast-shader".into()).stack_size(STACK_BYTES);
        let translation = thread
            .spawn_scoped(scope, || translate_here(module, name, stage, specialization, options))
            .map_err(|error| Error::NoThread { reason: error.to_string() })?;
        translation.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

fn translate_here(
    module: &Module,
    name: &str,
    stage: Stage,
    specialization: &Specialization,
    options: &Options,
) -> Result<Shader, Error> {
    check_capabilities(module)?;
    let globals = Globals::new(module, specialization)?;
    let declaration = find_entry(module, name, stage)?;
    let entry = declaration.id(1).map_err(|_| no_entry(name, stage))?;
    let function = module.functions.get(&entry).copied().ok_or_else(|| no_entry(name, stage))?;
    let mut analysis = Analysis::new(module, &globals, function)?;
    // An output with an initializer is written although no code names it.
    let named = declaration.ids(3);
    analysis.used.extend(named.iter().filter(|id| {
        let variable = globals.variables.get(id);
        variable.is_some_and(|it| it.class == StorageClass::Output && it.initializer.is_some())
    }));
    let interface = execution_modes(module, &globals, entry, stage)?;
    let translator = Translator {
        module,
        globals: &globals,
        analysis: &analysis,
        options: *options,
        emit: Emitter::new(),
        io: InputsOutputs::new(module, &globals, &interface, options),
        promoted: PromotedVariables::default(),
        interface,
        never_contracted: never_contracted(module, &globals, entry)?,
        next_resource_slot: 0,
        workgroup_block: None,
        vertex_memory: VertexPlaces::default(),
        values: HashMap::new(),
        types: HashMap::new(),
    };
    let mut control_flow = ControlFlow::new(translator);
    control_flow.run(function)?;
    finish(control_flow.t, declaration, &named)
}

/// The interface of an entry point with its execution modes, still without inputs and outputs.
fn execution_modes(module: &Module, globals: &Globals, entry: u32, stage: Stage) -> Result<Interface, Error> {
    let mut interface = empty_interface(stage);
    let (mut is_early_and_late, mut replaces_stencil) = (false, false);
    for instruction in &module.sections.execution_modes {
        if instruction.id(0).ok() == Some(entry) {
            execution_mode(globals, instruction, &mut interface)
                .map_err(|diagnostic| diagnostic.locate(instruction.reference()))?;
            let mode = instruction.enumerant(1, ExecutionMode::from_u32);
            is_early_and_late |= mode == Some(ExecutionMode::EarlyAndLateFragmentTestsAMD);
            replaces_stencil |= mode == Some(ExecutionMode::StencilRefReplacingEXT);
        }
    }
    // Late tests are needed for a written depth or stencil reference only, and early ones are optional then.
    let writes_tested = interface.depth != DepthMode::NotWritten || replaces_stencil;
    interface.early_fragment_tests |= is_early_and_late && !writes_tested;
    if stage == Stage::Compute {
        if let Some(size) = built_in_workgroup_size(module, globals) {
            interface.workgroup_size = size;
        }
        let [x, y, z] = interface.workgroup_size.map(u64::from);
        let limit = MAX_LANES as u64;
        if x.saturating_mul(y).saturating_mul(z) > limit || x * y * z == 0 {
            return Err(Error::TooLarge { what: "invocations of a workgroup", limit });
        }
    }
    Ok(interface)
}

/// The floating-point types whose default fast-math mode forbids contraction.
fn never_contracted(module: &Module, globals: &Globals, entry: u32) -> Result<Vec<Scalar>, Error> {
    let mut found = Vec::new();
    for instruction in &module.sections.execution_modes {
        let mode = instruction.enumerant(1, ExecutionMode::from_u32);
        if instruction.id(0).ok() != Some(entry) || mode != Some(ExecutionMode::FPFastMathDefault) {
            continue;
        }
        let add = || -> Result<Option<Scalar>> {
            let (scalar, _) = globals.types.vector(instruction.id(2)?)?;
            let Some(bits) = globals.constant_u32(instruction.id(3)?) else {
                return malformed("the fast-math mode isn't a constant");
            };
            let mode = FPFastMathMode::from_bits_truncate(bits);
            Ok((!mode.contains(FPFastMathMode::ALLOW_CONTRACT)).then_some(scalar))
        };
        found.extend(add().map_err(|diagnostic| diagnostic.locate(instruction.reference()))?);
    }
    Ok(found)
}

/// The workgroup's size from the constant with the built-in decoration, which overrides the execution mode.
fn built_in_workgroup_size(module: &Module, globals: &Globals) -> Option<[u32; 3]> {
    let mut constants = globals.constants.iter();
    let (_, constant) = constants.find(|(id, _)| module.built_in(**id) == Some(BuiltIn::WorkgroupSize))?;
    match *constant.bits {
        [x, y, z] => Some([x as u32, y as u32, z as u32]),
        _ => None,
    }
}

fn execution_mode(globals: &Globals, instruction: &Instruction, interface: &mut Interface) -> Result<()> {
    let constant = |index| {
        let id = instruction.id(index)?;
        match globals.constant_u32(id) {
            Some(value) => Ok(value),
            None => unsupported(format!("%{id} isn't a constant")),
        }
    };
    let Some(mode) = instruction.enumerant(1, ExecutionMode::from_u32) else {
        return malformed("there is no mode");
    };
    match mode {
        ExecutionMode::LocalSize => {
            interface.workgroup_size = [instruction.number(2)?, instruction.number(3)?, instruction.number(4)?];
        }
        ExecutionMode::LocalSizeId => {
            interface.workgroup_size = [constant(2)?, constant(3)?, constant(4)?];
        }
        ExecutionMode::EarlyFragmentTests => interface.early_fragment_tests = true,
        ExecutionMode::PostDepthCoverage => interface.post_depth_coverage = true,
        ExecutionMode::DepthReplacing if interface.depth == DepthMode::NotWritten => {
            interface.depth = DepthMode::Replacing;
        }
        ExecutionMode::DepthGreater => interface.depth = DepthMode::Greater,
        ExecutionMode::DepthLess => interface.depth = DepthMode::Less,
        ExecutionMode::DepthUnchanged => interface.depth = DepthMode::Unchanged,
        ExecutionMode::OriginLowerLeft => {
            return unsupported("an origin at the lower left");
        }
        ExecutionMode::Xfb => interface.transform_feedback = Some(TransformFeedback::default()),
        _ => return primitive_mode(instruction, mode, interface.stage, &mut interface.modes),
    }
    Ok(())
}

/// An execution mode of tessellation and geometry stages.
fn primitive_mode(
    instruction: &Instruction,
    mode: ExecutionMode,
    stage: Stage,
    modes: &mut PrimitiveModes,
) -> Result<()> {
    match mode {
        ExecutionMode::Triangles if stage == Stage::Geometry => {
            modes.input = Some(InputPrimitive::Triangles);
        }
        ExecutionMode::Triangles => modes.domain = Some(Domain::Triangles),
        ExecutionMode::Quads => modes.domain = Some(Domain::Quads),
        ExecutionMode::Isolines => modes.domain = Some(Domain::Isolines),
        ExecutionMode::SpacingEqual => modes.spacing = Some(Spacing::Equal),
        ExecutionMode::SpacingFractionalEven => modes.spacing = Some(Spacing::FractionalEven),
        ExecutionMode::SpacingFractionalOdd => modes.spacing = Some(Spacing::FractionalOdd),
        ExecutionMode::VertexOrderCw => modes.clockwise = Some(true),
        ExecutionMode::VertexOrderCcw => modes.clockwise = Some(false),
        ExecutionMode::PointMode => modes.point_mode = true,
        ExecutionMode::OutputVertices => modes.output_vertices = Some(instruction.number(2)?),
        ExecutionMode::Invocations => modes.invocations = Some(instruction.number(2)?),
        ExecutionMode::InputPoints => modes.input = Some(InputPrimitive::Points),
        ExecutionMode::InputLines => modes.input = Some(InputPrimitive::Lines),
        ExecutionMode::InputLinesAdjacency => modes.input = Some(InputPrimitive::LinesAdjacency),
        ExecutionMode::InputTrianglesAdjacency => {
            modes.input = Some(InputPrimitive::TrianglesAdjacency);
        }
        ExecutionMode::OutputPoints => modes.output = Some(OutputPrimitive::Points),
        ExecutionMode::OutputLineStrip => modes.output = Some(OutputPrimitive::LineStrip),
        ExecutionMode::OutputTriangleStrip => modes.output = Some(OutputPrimitive::TriangleStrip),
        _ => {}
    }
    Ok(())
}

/// The translated shader of an entry point whose declaration names these variables.
fn finish(mut t: Translator, declaration: &Instruction, named: &[u32]) -> Result<Shader, Error> {
    variables::declare_push_constants(&mut t);
    vertex_memory::describe(&mut t)
        .and_then(|()| transform_feedback::describe(&mut t, named))
        .map_err(|diagnostic| diagnostic.locate(declaration.reference()))?;
    t.interface.per_sample = t.io.per_sample || variables::has_an_input_of_samples(&t, named);
    t.interface.inputs = t.io.inputs;
    t.interface.outputs = t.io.outputs;
    let has_coherent_accesses = t.module.has_coherent_accesses();
    let program = Program { has_coherent_accesses, ..t.emit.builder.finish()? };
    Ok(Shader { program, interface: t.interface })
}

fn empty_interface(stage: Stage) -> Interface {
    Interface {
        stage,
        inputs: Vec::new(),
        outputs: Vec::new(),
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
    }
}

fn no_entry(name: &str, stage: Stage) -> Error {
    Error::NoEntryPoint { name: name.into(), stage }
}

/// The declaration of an entry point.
fn find_entry<'a>(module: &'a Module, name: &str, stage: Stage) -> Result<&'a Instruction, Error> {
    let model = match stage {
        Stage::Vertex => ExecutionModel::Vertex,
        Stage::TessellationControl => ExecutionModel::TessellationControl,
        Stage::TessellationEvaluation => ExecutionModel::TessellationEvaluation,
        Stage::Geometry => ExecutionModel::Geometry,
        Stage::Fragment => ExecutionModel::Fragment,
        Stage::Compute => ExecutionModel::GLCompute,
    };
    let mut entries = module.sections.entry_points.iter();
    entries
        .find(|it| it.enumerant(0, ExecutionModel::from_u32) == Some(model) && it.string(2) == Some(name))
        .ok_or_else(|| no_entry(name, stage))
}

/// Refuses modules that declare unsupported capabilities.
fn check_capabilities(module: &Module) -> Result<(), Error> {
    for instruction in &module.sections.capabilities {
        if let Some(capability) = instruction.enumerant(0, Capability::from_u32)
            && !is_supported(capability)
        {
            let diagnostic = Diagnostic::Unsupported(format!("capability {capability:?}"));
            return Err(diagnostic.locate(instruction.reference()));
        }
    }
    let model = module.sections.memory_model.as_ref();
    let Some(model) = model else {
        return Err(Error::Binary { reason: "there is no memory model".into() });
    };
    let addressing = model.enumerant(0, AddressingModel::from_u32);
    let memory = model.enumerant(1, MemoryModel::from_u32);
    match (addressing, memory) {
        (
            Some(AddressingModel::Logical | AddressingModel::PhysicalStorageBuffer64),
            Some(MemoryModel::GLSL450 | MemoryModel::Vulkan),
        ) => Ok(()),
        _ => Err(Diagnostic::Unsupported("this memory model".into()).locate(model.reference())),
    }
}

/// Tells if a capability's instructions and decorations are translated.
pub fn is_supported(capability: Capability) -> bool {
    use Capability as C;
    matches!(
        capability,
        C::Matrix
            | C::Shader
            | C::Geometry
            | C::GeometryPointSize
            | C::GeometryStreams
            | C::TransformFeedback
            | C::Tessellation
            | C::TessellationPointSize
            | C::Float16
            | C::Float64
            | C::Int64
            | C::Int64Atomics
            | C::Int16
            | C::Int8
            | C::ImageGatherExtended
            | C::StorageImageMultisample
            | C::UniformBufferArrayDynamicIndexing
            | C::SampledImageArrayDynamicIndexing
            | C::StorageBufferArrayDynamicIndexing
            | C::StorageImageArrayDynamicIndexing
            | C::ClipDistance
            | C::CullDistance
            | C::ImageCubeArray
            | C::SampleRateShading
            | C::SampledCubeArray
            | C::InputAttachment
            | C::MinLod
            | C::Sampled1D
            | C::Image1D
            | C::SampledBuffer
            | C::ImageBuffer
            | C::ImageMSArray
            | C::StorageImageExtendedFormats
            | C::ImageQuery
            | C::DerivativeControl
            | C::InterpolationFunction
            | C::StorageImageReadWithoutFormat
            | C::StorageImageWriteWithoutFormat
            | C::MultiView
            | C::MultiViewport
            | C::VariablePointers
            | C::VariablePointersStorageBuffer
            | C::WorkgroupMemoryExplicitLayoutKHR
            | C::WorkgroupMemoryExplicitLayout8BitAccessKHR
            | C::WorkgroupMemoryExplicitLayout16BitAccessKHR
            | C::DotProduct
            | C::DotProductInputAll
            | C::DotProductInput4x8Bit
            | C::DotProductInput4x8BitPacked
            | C::GroupNonUniform
            | C::GroupNonUniformVote
            | C::GroupNonUniformArithmetic
            | C::GroupNonUniformBallot
            | C::GroupNonUniformShuffle
            | C::GroupNonUniformShuffleRelative
            | C::GroupNonUniformClustered
            | C::GroupNonUniformQuad
            | C::ShaderLayer
            | C::ShaderViewportIndex
            | C::ShaderViewportIndexLayerEXT
            | C::SubgroupBallotKHR
            | C::SubgroupVoteKHR
            | C::DrawParameters
            | C::DeviceGroup
            | C::StorageBuffer16BitAccess
            | C::UniformAndStorageBuffer16BitAccess
            | C::StoragePushConstant16
            | C::StorageInputOutput16
            | C::StorageBuffer8BitAccess
            | C::UniformAndStorageBuffer8BitAccess
            | C::StoragePushConstant8
            | C::SignedZeroInfNanPreserve
            | C::DenormPreserve
            | C::RoundingModeRTE
            | C::ShaderNonUniform
            | C::RuntimeDescriptorArray
            | C::InputAttachmentArrayDynamicIndexing
            | C::UniformTexelBufferArrayDynamicIndexing
            | C::StorageTexelBufferArrayDynamicIndexing
            | C::UniformBufferArrayNonUniformIndexing
            | C::SampledImageArrayNonUniformIndexing
            | C::StorageBufferArrayNonUniformIndexing
            | C::StorageImageArrayNonUniformIndexing
            | C::InputAttachmentArrayNonUniformIndexing
            | C::UniformTexelBufferArrayNonUniformIndexing
            | C::StorageTexelBufferArrayNonUniformIndexing
            | C::PhysicalStorageBufferAddresses
            | C::VulkanMemoryModel
            | C::VulkanMemoryModelDeviceScope
            | C::DemoteToHelperInvocation
            | C::StencilExportEXT
            | C::SampleMaskPostDepthCoverage
            | C::ShaderClockKHR
            | C::AtomicFloat32AddEXT
            | C::AtomicFloat32MinMaxEXT
            | C::ExpectAssumeKHR
            | C::GroupNonUniformRotateKHR
            | C::QuadControlKHR
            | C::FloatControls2
            | C::ReplicatedCompositesEXT
    )
}
