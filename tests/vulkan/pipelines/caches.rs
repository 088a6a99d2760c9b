//! Pipeline creation without compilation, and pipeline caches.

use ash::vk;
use gaurast_testkit::devices::own;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::shader::{Stage, compile};

/// A pipeline that needs compilation is not created if the application forbids compilation. The other pipelines of the
/// call are created, unless early return is requested.
#[gaurast_runner::test(needs = [GLSLANG])]
fn pipelines_that_may_not_be_compiled_are_not_created() {
    let gpu = own();
    let device = gpu.device();
    let words = compile(Stage::Compute, "layout(local_size_x = 1) in; void main() {}");
    let fail = vk::PipelineCreateFlags::FAIL_ON_PIPELINE_COMPILE_REQUIRED;
    let early = fail | vk::PipelineCreateFlags::EARLY_RETURN_ON_FAILURE;
    let none = vk::PipelineCreateFlags::empty();
    let info = vk::ShaderModuleCreateInfo::default().code(&words);
    // SAFETY: the create infos are valid.
    unsafe {
        let module = device.create_shader_module(&info, None).expect("a module");
        let layout = device.create_pipeline_layout(&vk::PipelineLayoutCreateInfo::default(), None).expect("a layout");
        let flags = vk::PipelineCacheCreateFlags::EXTERNALLY_SYNCHRONIZED;
        let info = vk::PipelineCacheCreateInfo::default().flags(flags);
        let cache = device.create_pipeline_cache(&info, None).expect("a cache");
        let create = |flags: &[vk::PipelineCreateFlags]| {
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module)
                .name(c"main");
            let infos: Vec<_> = flags
                .iter()
                .map(|&flags| vk::ComputePipelineCreateInfo::default().flags(flags).stage(stage).layout(layout))
                .collect();
            let (pipelines, result) = match device.create_compute_pipelines(cache, &infos, None) {
                Ok(pipelines) => (pipelines, vk::Result::SUCCESS),
                Err(both) => both,
            };
            let created: Vec<_> = pipelines.iter().map(|&pipeline| pipeline != vk::Pipeline::null()).collect();
            for pipeline in pipelines {
                device.destroy_pipeline(pipeline, None);
            }
            (created, result)
        };
        let required = vk::Result::PIPELINE_COMPILE_REQUIRED;
        assert_eq!(create(&[none, none]), (vec![true, true], vk::Result::SUCCESS));
        assert_eq!(create(&[none, fail, none]), (vec![true, false, true], required));
        assert_eq!(create(&[none, early, none]), (vec![true, false, false], required));
        device.destroy_pipeline_cache(cache, None);
        device.destroy_pipeline_layout(layout, None);
        device.destroy_shader_module(module, None);
    }
}
