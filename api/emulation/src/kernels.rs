//! The kernels, as pipelines of a device.

use std::collections::HashMap;
use std::io::Cursor;
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;

use crate::next::Next;
use crate::precision;
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
    Histogram,
    ScanDigits,
    Scatter,
    ScanTiles,
    CountPairs,
    Emit,
    Ranges,
    Tests,
}

impl Kernel {
    const ALL: [(Self, &'static [u8]); 9] = [
        (Self::Prepare, spirv!("prepare.comp")),
        (Self::Histogram, spirv!("histogram.comp")),
        (Self::ScanDigits, spirv!("scan_digits.comp")),
        (Self::Scatter, spirv!("scatter.comp")),
        (Self::ScanTiles, spirv!("scan_tiles.comp")),
        (Self::CountPairs, spirv!("count_pairs.comp")),
        (Self::Emit, spirv!("emit.comp")),
        (Self::Ranges, spirv!("ranges.comp")),
        (Self::Tests, spirv!("tests.comp")),
    ];
}

/// The constants that a pipeline of Gaussians fixes in the kernels, as `shaders/variant.glsl` has it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct Variant {
    pub(crate) has_matrix: bool,
    pub(crate) has_factor: bool,
    pub(crate) harmonics_in_buffer: bool,
    pub(crate) is_float32: bool,
    pub(crate) are_harmonics_even: bool,
    pub(crate) has_cut_tiles: bool,
    pub(crate) degree: u32,
    /// Cameras may be fisheyes or panoramas.
    pub(crate) has_angles: bool,
    pub(crate) is_unscented: bool,
    pub(crate) is_surfel: bool,
    /// Depths or stencils are tested.
    pub(crate) has_tests: bool,
    /// Scales are logarithms.
    pub(crate) has_logarithms: bool,
    /// Opacities are logits.
    pub(crate) has_logits: bool,
    /// A resolve shader reads depths or Gaussians.
    pub(crate) is_resolved: bool,
    /// A camera has a lens that distorts.
    pub(crate) has_lens: bool,
    /// Attributes are decoded from integers.
    pub(crate) has_decodings: bool,
    /// A vertex shader projects: in another kernel.
    pub(crate) is_shaded: bool,
}

impl Variant {
    /// The specialization constants of the kernel that projects.
    fn of_projection(&self) -> [u32; 16] {
        [
            u32::from(self.has_matrix),
            u32::from(self.has_factor),
            u32::from(self.harmonics_in_buffer),
            u32::from(self.is_float32),
            u32::from(self.are_harmonics_even),
            u32::from(self.has_cut_tiles),
            self.degree,
            u32::from(self.has_angles),
            u32::from(self.is_unscented),
            u32::from(self.is_surfel),
            u32::from(self.has_tests || self.is_resolved),
            u32::from(self.has_logarithms),
            u32::from(self.has_logits),
            u32::from(self.is_resolved),
            u32::from(self.has_lens),
            u32::from(self.has_decodings),
        ]
    }

    /// The specialization constants of the rasterizer.
    fn of_rasterizer(&self) -> [u32; 5] {
        [self.has_cut_tiles, self.has_angles, self.is_surfel, self.has_tests, self.is_resolved].map(u32::from)
    }
}

/// The kernels of a variant.
#[derive(Clone, Copy)]
pub(crate) struct Specialized {
    pub(crate) project: vk::Pipeline,
    pub(crate) raster: vk::Pipeline,
}

/// The kernels that copy attachments with several samples.
pub(crate) struct Samples {
    pub(crate) set_layout: vk::DescriptorSetLayout,
    pub(crate) layout: vk::PipelineLayout,
    pub(crate) depths: vk::Pipeline,
    pub(crate) stencils: vk::Pipeline,
}

impl Samples {
    /// # Safety
    /// The device lives.
    unsafe fn new(next: &Arc<Next>) -> Result<Self, vk::Result> {
        let bindings = [vk::DescriptorSetLayoutBinding::default()
            .descriptor_type(vk::DescriptorType::SAMPLED_IMAGE)
            .descriptor_count(1)
            .stage_flags(vk::ShaderStageFlags::COMPUTE)];
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the caller's promise.
        unsafe {
            let set_layout = next.create_descriptor_set_layout(&info, None)?;
            let layout = layout(next, &[set_layout], vk::ShaderStageFlags::COMPUTE)?;
            let create = |words: &[u8]| {
                let module = module(next, words)?;
                let pipeline = compute(next, module, layout, &[]);
                next.destroy_shader_module(module, None);
                pipeline
            };
            let (depths, stencils) = (spirv!("samples.comp"), spirv!("samples_stencils.comp"));
            Ok(Self { set_layout, layout, depths: create(depths)?, stencils: create(stencils)? })
        }
    }
}

/// Bytes of push constants of kernels, and of the fragment shader that fetches.
pub(crate) const PUSHED: u32 = 72;

/// The pipelines of all kernels, and the shaders of the pipelines that the application creates.
pub(crate) struct Kernels {
    next: Arc<Next>,
    /// Of the kernels.
    pub(crate) layout: vk::PipelineLayout,
    /// Of the shaders that show a set.
    pub(crate) fetch_layout: vk::PipelineLayout,
    pipelines: Vec<vk::Pipeline>,
    specialized: Mutex<HashMap<Variant, Specialized>>,
    pub(crate) vertex: vk::ShaderModule,
    pub(crate) fetch: vk::ShaderModule,
    /// For passes with views.
    pub(crate) vertex_views: vk::ShaderModule,
    pub(crate) fetch_views: vk::ShaderModule,
    /// For resolve shaders.
    pub(crate) vertex_resolved: vk::ShaderModule,
    pub(crate) vertex_resolved_views: vk::ShaderModule,
    /// For sets whose depths or stencils are tested.
    pub(crate) fetch_tested: vk::ShaderModule,
    pub(crate) fetch_tested_views: vk::ShaderModule,
    pub(crate) samples: Samples,
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
                fetch_layout: layout(next, &[], vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT)?,
                pipelines: Vec::new(),
                specialized: Mutex::default(),
                vertex: module(next, spirv!("tiles.vert"))?,
                fetch: module(next, spirv!("fetch.frag"))?,
                // A device without views has no such passes.
                vertex_views: module(next, spirv!("tiles_views.vert")).unwrap_or_default(),
                fetch_views: module(next, spirv!("fetch_views.frag"))?,
                vertex_resolved: module(next, spirv!("tiles_resolved.vert"))?,
                vertex_resolved_views: module(next, spirv!("tiles_resolved_views.vert")).unwrap_or_default(),
                fetch_tested: module(next, spirv!("fetch_tested.frag"))?,
                fetch_tested_views: module(next, spirv!("fetch_tested_views.frag"))?,
                samples: Samples::new(next)?,
                feedback,
            };
            for (_, words) in Kernel::ALL {
                let module = module(next, words)?;
                let pipeline = compute(next, module, own.layout, &[]);
                next.destroy_shader_module(module, None);
                own.pipelines.push(pipeline?);
            }
            Ok(own)
        }
    }

    pub(crate) fn pipeline(&self, kernel: Kernel) -> vk::Pipeline {
        self.pipelines[kernel as usize]
    }

    /// The kernels of a variant, which are compiled when it is first asked for.
    pub(crate) fn specialized(&self, variant: Variant) -> Result<Specialized, vk::Result> {
        let mut all = self.specialized.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = all.get(&variant) {
            return Ok(*known);
        }
        let create = |words: &[u8], constants: &[u32]| {
            // SAFETY: the device lives, and the module is valid.
            unsafe {
                let module = module(&self.next, words)?;
                let pipeline = compute(&self.next, module, self.layout, constants);
                self.next.destroy_shader_module(module, None);
                pipeline
            }
        };
        let projecting: &[u8] = if variant.is_shaded { spirv!("project_shaded.comp") } else { spirv!("project.comp") };
        let project = create(projecting, &variant.of_projection())?;
        let raster = create(spirv!("raster.comp"), &variant.of_rasterizer());
        let raster = raster.inspect_err(|_| {
            // SAFETY: nothing uses it yet.
            unsafe { self.next.destroy_pipeline(project, None) };
        })?;
        let new = Specialized { project, raster };
        all.insert(variant, new);
        Ok(new)
    }
}

impl Drop for Kernels {
    fn drop(&mut self) {
        // SAFETY: nothing is executed on the device any more.
        unsafe {
            let specialized = std::mem::take(self.specialized.get_mut().unwrap_or_else(PoisonError::into_inner));
            let specialized = specialized.values().flat_map(|own| [own.project, own.raster]);
            for pipeline in self.pipelines.drain(..).chain(specialized) {
                self.next.destroy_pipeline(pipeline, None);
            }
            let modules = [self.vertex, self.fetch, self.vertex_views, self.fetch_views];
            let more = [self.fetch_tested, self.fetch_tested_views, self.vertex_resolved, self.vertex_resolved_views];
            for module in modules.into_iter().chain(more) {
                self.next.destroy_shader_module(module, None);
            }
            for pipeline in [self.samples.depths, self.samples.stencils] {
                self.next.destroy_pipeline(pipeline, None);
            }
            for layout in [self.layout, self.fetch_layout, self.samples.layout] {
                self.next.destroy_pipeline_layout(layout, None);
            }
            self.next.destroy_descriptor_set_layout(self.samples.set_layout, None);
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

/// The number of the constant that is true with a relaxed precision.
const IS_RELAXED: u32 = 31;

/// A compute pipeline, with the module's specialization constants in the order of their numbers, and that of the precision.
///
/// # Safety
/// The device, the module and the layout live.
pub(crate) unsafe fn compute(
    next: &ash::Device,
    module: vk::ShaderModule,
    layout: vk::PipelineLayout,
    constants: &[u32],
) -> Result<vk::Pipeline, vk::Result> {
    let numbers = (0..constants.len() as u32).chain([IS_RELAXED]);
    let values: Vec<u32> = constants.iter().copied().chain([u32::from(precision::is_relaxed())]).collect();
    let entry = |(place, constant_id)| vk::SpecializationMapEntry { constant_id, offset: 4 * place, size: 4 };
    let entries: Vec<vk::SpecializationMapEntry> = (0_u32..).zip(numbers).map(entry).collect();
    let special = vk::SpecializationInfo::default().map_entries(&entries).data(bytemuck::cast_slice(&values));
    let stage = vk::PipelineShaderStageCreateInfo::default()
        .stage(vk::ShaderStageFlags::COMPUTE)
        .module(module)
        .name(c"main")
        .specialization_info(&special);
    let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout)];
    // SAFETY: the caller's promise.
    let created = unsafe { next.create_compute_pipelines(vk::PipelineCache::null(), &info, None) };
    match created {
        Ok(pipelines) => pipelines.first().copied().ok_or(vk::Result::ERROR_UNKNOWN),
        Err((_, error)) => Err(error),
    }
}
