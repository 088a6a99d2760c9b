//! Compute pipelines.

use super::layout::PipelineLayout;
use super::stages::ProgramResources;
use crate::abi::error::Error;
use crate::device::Device;
use crate::physical_device::limits;
use crate::shader_module::ShaderStage;
use gaurast_spirv::{BuiltIn, Input, InputSource, Interface, Options, Stage};
use simdevice::program::compute::ComputeProgram;
use simdevice::program::interface::ComputeInput;
use std::sync::Arc;

/// A compute pipeline.
#[derive(Debug)]
pub(crate) struct ComputePipeline {
    /// The program that its workgroups run.
    pub(crate) program: Arc<ComputeProgram>,
    /// The resources that the program is bound to.
    pub(crate) resources: ProgramResources,
}

impl ComputePipeline {
    /// Translates a compute shader.
    ///
    /// # Errors
    /// [`Error::InvalidShader`] if it is malformed or asks for what the device lacks; [`Error::InvalidUsage`] if it
    /// does not fit the layout.
    pub(crate) fn new(device: &Device, layout: &PipelineLayout, stage: &ShaderStage) -> Result<Self, Error> {
        let subgroup_size = stage.required_subgroup_size.unwrap_or(limits::SUBGROUP_SIZE);
        let options = Options { subgroup_size, unsized_descriptors: layout.longest_binding(), ..Options::default() };
        let shader = stage.translate(Stage::Compute, &options)?;
        let interface = &shader.interface;
        layout.check(interface)?;
        let invocations = invocations(interface)?;
        if device.dumps_ir() {
            eprintln!("compute shader {}:\n{}", stage.name, shader.program);
        }
        let shared = shader.program.shared_bytes;
        if shared > limits::MAX_SHARED_BYTES {
            return Err(Error::InvalidShader(format!(
                "the workgroup has {shared} bytes of shared memory, more than {}",
                limits::MAX_SHARED_BYTES
            )));
        }
        let inputs = inputs(interface);
        let resources = ProgramResources::new(device, interface);
        let program =
            ComputeProgram::new(device.simulated().level(), shader.program, invocations, subgroup_size, inputs)
                .map_err(|error| Error::InvalidShader(error.to_string()))?;
        Ok(Self { program: Arc::new(program), resources })
    }
}

/// The number of invocations of a workgroup.
fn invocations(interface: &Interface) -> Result<u32, Error> {
    let size = interface.workgroup_size;
    let product = size.into_iter().try_fold(1u32, |product, size| product.checked_mul(size));
    let fits = std::iter::zip(size, limits::MAX_WORKGROUP_SIZE).all(|(size, max)| size <= max);
    product.filter(|product| fits && (1..=limits::MAX_WORKGROUP_INVOCATIONS).contains(product)).ok_or_else(|| {
        Error::InvalidShader(format!(
            "a workgroup of {size:?} is larger than {:?} with at most {} invocations",
            limits::MAX_WORKGROUP_SIZE,
            limits::MAX_WORKGROUP_INVOCATIONS
        ))
    })
}

/// The values that the device gives to the program's inputs.
fn inputs(interface: &Interface) -> Vec<Option<ComputeInput>> {
    let input = |input: &Input| match input.source {
        InputSource::BuiltIn { built_in: BuiltIn::WorkgroupId, component } => {
            Some(ComputeInput::WorkgroupId(component as usize % 3))
        }
        InputSource::BuiltIn { built_in: BuiltIn::NumWorkgroups, component } => {
            Some(ComputeInput::WorkgroupCount(component as usize % 3))
        }
        _ => None,
    };
    interface.inputs.iter().map(input).collect()
}
