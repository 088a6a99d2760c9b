//! The kernels, as pipelines of a device.

use std::io::Cursor;
use std::sync::Arc;

use ash::vk;

use crate::next::Next;
use crate::scratch::Memory;

macro_rules! spirv {
    ($name:literal) => {
        include_bytes!(concat!("../shaders/", $name, ".spv"))
    };
}

/// The camera's kernel, of which each pipeline makes its own.
pub(crate) const CAMERA: &[u8] = spirv!("camera.comp");
/// The kernel of the self-test.
pub(crate) const SELF_TEST: &[u8] = spirv!("self_test.comp");

/// A kernel of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kernel {
    Prepare,
    Project,
    Histogram,
    ScanBlocks,
    ScanSums,
    Scatter,
    Count,
    Emit,
    Ranges,
    Raster,
}

impl Kernel {
    const ALL: [(Self, &'static [u8]); 10] = [
        (Self::Prepare, spirv!("prepare.comp")),
        (Self::Project, spirv!("project.comp")),
        (Self::Histogram, spirv!("histogram.comp")),
        (Self::ScanBlocks, spirv!("scan_blocks.comp")),
        (Self::ScanSums, spirv!("scan_sums.comp")),
        (Self::Scatter, spirv!("scatter.comp")),
        (Self::Count, spirv!("count.comp")),
        (Self::Emit, spirv!("emit.comp")),
        (Self::Ranges, spirv!("ranges.comp")),
        (Self::Raster, spirv!("raster.comp")),
    ];
}

/// Bytes of push constants of kernels, and of the fragment shader that fetches.
pub(crate) const PUSHED: u32 = 32;

/// The pipelines of all kernels, and the shaders of the pipelines that the application creates.
pub(crate) struct Kernels {
    next: Arc<Next>,
    /// Of the kernels.
    pub(crate) layout: vk::PipelineLayout,
    /// Of the fragment shaders.
    pub(crate) fetch_layout: vk::PipelineLayout,
    pipelines: Vec<vk::Pipeline>,
    pub(crate) vertex: vk::ShaderModule,
    pub(crate) fetch: vk::ShaderModule,
    /// For passes with views.
    pub(crate) vertex_views: vk::ShaderModule,
    pub(crate) fetch_views: vk::ShaderModule,
    /// The most pairs of a set so far, which the device writes.
    pub(crate) feedback: Memory,
}

impl Kernels {
    pub(crate) fn new(next: &Arc<Next>) -> Result<Self, vk::Result> {
        let feedback = Memory::new(next, 256, true)?;
        feedback.set_word(0, 0);
        // SAFETY: the device lives, and the modules are valid.
        unsafe {
            let mut own = Self {
                next: Arc::clone(next),
                layout: layout(next, &[], vk::ShaderStageFlags::COMPUTE)?,
                fetch_layout: layout(next, &[], vk::ShaderStageFlags::FRAGMENT)?,
                pipelines: Vec::new(),
                vertex: module(next, spirv!("full.vert"))?,
                fetch: module(next, spirv!("fetch.frag"))?,
                // A device without views has no such passes.
                vertex_views: module(next, spirv!("full_views.vert")).unwrap_or_default(),
                fetch_views: module(next, spirv!("fetch_views.frag"))?,
                feedback,
            };
            for (_, words) in Kernel::ALL {
                let module = module(next, words)?;
                let pipeline = compute(next, module, own.layout, None);
                next.destroy_shader_module(module, None);
                own.pipelines.push(pipeline?);
            }
            Ok(own)
        }
    }

    pub(crate) fn pipeline(&self, kernel: Kernel) -> vk::Pipeline {
        self.pipelines[kernel as usize]
    }
}

impl Drop for Kernels {
    fn drop(&mut self) {
        // SAFETY: nothing is executed on the device any more.
        unsafe {
            for &pipeline in &self.pipelines {
                self.next.destroy_pipeline(pipeline, None);
            }
            for module in [self.vertex, self.fetch, self.vertex_views, self.fetch_views] {
                self.next.destroy_shader_module(module, None);
            }
            for layout in [self.layout, self.fetch_layout] {
                self.next.destroy_pipeline_layout(layout, None);
            }
        }
    }
}

/// Words of a SPIR-V module.
pub(crate) fn words(bytes: &[u8]) -> Vec<u32> {
    ash::util::read_spv(&mut Cursor::new(bytes)).unwrap_or_default()
}

/// # Safety
/// The device lives.
pub(crate) unsafe fn module(next: &ash::Device, bytes: &[u8]) -> Result<vk::ShaderModule, vk::Result> {
    let words = words(bytes);
    let info = vk::ShaderModuleCreateInfo::default().code(&words);
    // SAFETY: the caller's promise.
    unsafe { next.create_shader_module(&info, None) }
}

/// A layout with push constants for a stage.
///
/// # Safety
/// The device and the layouts live.
pub(crate) unsafe fn layout(
    next: &ash::Device,
    sets: &[vk::DescriptorSetLayout],
    stage: vk::ShaderStageFlags,
) -> Result<vk::PipelineLayout, vk::Result> {
    let ranges = [vk::PushConstantRange { stage_flags: stage, offset: 0, size: PUSHED }];
    let info = vk::PipelineLayoutCreateInfo::default().set_layouts(sets).push_constant_ranges(&ranges);
    // SAFETY: the caller's promise.
    unsafe { next.create_pipeline_layout(&info, None) }
}

/// A compute pipeline; `rows` is the module's specialization constant.
///
/// # Safety
/// The device, the module and the layout live.
pub(crate) unsafe fn compute(
    next: &ash::Device,
    module: vk::ShaderModule,
    layout: vk::PipelineLayout,
    rows: Option<u32>,
) -> Result<vk::Pipeline, vk::Result> {
    let entries = [vk::SpecializationMapEntry { constant_id: 0, offset: 0, size: 4 }];
    let data = rows.unwrap_or(0).to_ne_bytes();
    let special = vk::SpecializationInfo::default().map_entries(&entries).data(&data);
    let mut stage =
        vk::PipelineShaderStageCreateInfo::default().stage(vk::ShaderStageFlags::COMPUTE).module(module).name(c"main");
    if rows.is_some() {
        stage = stage.specialization_info(&special);
    }
    let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout)];
    // SAFETY: the caller's promise.
    let created = unsafe { next.create_compute_pipelines(vk::PipelineCache::null(), &info, None) };
    match created {
        Ok(pipelines) => pipelines.first().copied().ok_or(vk::Result::ERROR_UNKNOWN),
        Err((_, error)) => Err(error),
    }
}
