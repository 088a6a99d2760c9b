//! The work of a sorted set: parameters for the kernels, and their dispatches.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;

use crate::attachments::{self, DepthStencil};
use crate::bindings::Bindings;
use crate::cameras::{Camera, Cameras};
use crate::depth_stencil::{Outcome, TestState};
use crate::draw_call::{COMMAND, Draw, ShaderDraw};
use crate::kernels::{Kernel, Kernels, PUSHED, Specialized, Variant};
use crate::lens::Lens;
use crate::made::{Area, Attributes, Covering, Made, MadeExtent, MadePlaces};
use crate::next::Next;
use crate::pair::{Pair, pair};
use crate::pipeline::{Attribute, Pipeline, Projecting};
use crate::projecting::OUTPUTS;
use crate::scratch::{Extent, Memory, Places};
use crate::times::Times;

/// The last model of cameras whose pixels are no angles.
const ORTHOGRAPHIC: i32 = 1;
/// Width and height of a tile.
const TILE: u32 = 16;

/// A vertex buffer of a draw, as `shaders/set.glsl` has it.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct DrawSource {
    pub(crate) address: u64,
    pub(crate) bytes: u32,
    pub(crate) stride: u32,
    pub(crate) divisor: u32,
    pub(crate) unused: u32,
}

/// The parameters of a set, as `shaders/set.glsl` has them.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Parameters {
    counters: u64,
    keys: u64,
    values: u64,
    pair_keys: u64,
    pair_values: u64,
    sums: u64,
    reached: u64,
    before_each: u64,
    ranges: u64,
    records: u64,
    image: u64,
    shown: u64,
    feedback: u64,
    draws: u64,
    sources: u64,
    cameras: u64,
    derived: u64,
    depths: u64,
    stored: u64,
    medians: u64,
    names: u64,
    inputs: u64,
    seen_by: u64,
    lenses: u64,
    rectangles: u64,
    unused: [u32; 2],
    area_origin: [i32; 2],
    area_size: [u32; 2],
    viewport: [f32; 4],
    tiles: [u32; 2],
    reserve: u32,
    pair_capacity: u32,
    draw_count: u32,
    source_count: u32,
    camera_count: u32,
    degree: u32,
    order: u32,
    compensated: u32,
    cut_off: u32,
    harmonics_step: u32,
    low_pass: f32,
    alpha_floor: f32,
    alpha_ceiling: f32,
    transmittance_floor: f32,
    compensation_floor: f32,
    cut_off_deviations: f32,
    is_surfel: u32,
    depth_compare: u32,
    depth_range: [f32; 2],
    depth_steps: u32,
    is_negative_one_to_one: u32,
    sigma_distance: Pair,
    sigma_center: Pair,
    sigma_other: Pair,
    picture: [Pair; 4],
    must_count: u32,
    is_shaded: u32,
    center: [Pair; 2],
    half_size: [f32; 2],
    attributes: [Attribute; 33],
    decodings: u32,
}

/// The push constants of kernels of a set.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Pushed {
    set: u64,
    view: u32,
    /// The half of the pairs that is read.
    side: u32,
    /// The view's first pixel.
    plane: u32,
    unused: u32,
}

/// The push constants of kernels of a sort's digit.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct PushedDigit {
    keys: u64,
    values: u64,
    sorted_keys: u64,
    sorted_values: u64,
    histogram: u64,
    totals: u64,
    counters: u64,
    shift: u32,
    count_place: u32,
    is_first_of_depths: u32,
    unused: u32,
}

/// The push constants of the kernel of tests.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct PushedTests {
    stored: u64,
    depths: u64,
    stencils: u64,
    count: u32,
    /// Bytes of a depth in what was copied; 0 without depths.
    depth_bytes: u32,
    depth_steps: u32,
    /// Bytes of a stencil in what was copied; 0 without stencils.
    stencil_bytes: u32,
    /// The least and the most; the other way round where they are not tested.
    bounds: [f32; 2],
    /// The operation, the compare mask and the reference, from the lowest byte on.
    stencil_compare: u32,
    are_floats: u32,
}

/// The push constants of the kernels that copy samples.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct PushedSamples {
    copied: u64,
    area_origin: [i32; 2],
    area_size: [u32; 2],
    samples: u32,
    unused: u32,
}

const _: () = assert!(size_of::<Pushed>() <= PUSHED as usize && size_of::<PushedDigit>() <= PUSHED as usize);
const _: () = assert!(size_of::<PushedTests>() <= PUSHED as usize && size_of::<Picture>() <= PUSHED as usize);

/// The numbers of a pipeline that may be dynamic, as they are at the set's first draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Values {
    pub(crate) order: u32,
    pub(crate) is_compensated: bool,
    pub(crate) low_pass: f32,
    pub(crate) alpha_floor: f32,
    pub(crate) alpha_ceiling: f32,
    pub(crate) transmittance_floor: f32,
    pub(crate) degree: u32,
}

/// The result of a set in its area, as `shaders/shown.glsl` has it.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Picture {
    /// The address of the pixels.
    image: u64,
    /// The address of a word for each tile.
    shown: u64,
    origin: [i32; 2],
    size: [u32; 2],
    /// The address of the samples' median depths.
    medians: u64,
    samples: u32,
    /// The sample that a draw shows, and the outcome of its tests.
    sample: u32,
    wanted: f32,
    unused: u32,
}

impl Picture {
    /// Chooses the sample that the next draw shows, and the outcome of its tests.
    pub(crate) fn show(&mut self, sample: u32, outcome: Outcome) {
        self.sample = sample;
        self.wanted = outcome.number();
    }
}

/// A set whose draws are known.
#[derive(Clone)]
pub(crate) struct Work {
    pub(crate) pipeline: Arc<Pipeline>,
    pub(crate) values: Values,
    pub(crate) cameras: Cameras,
    /// The lenses of the cameras, if one distorts.
    pub(crate) lenses: Vec<Lens>,
    /// Depth and stencil tests, if something is tested.
    pub(crate) tests: Option<TestState>,
    /// The least and the greatest depth of the viewport.
    pub(crate) depth_range: [f32; 2],
    /// x, y, width and height; not negative.
    pub(crate) viewport: [f32; 4],
    /// The middle of the viewport.
    pub(crate) center: [f64; 2],
    /// Half of its width and of its height, which may be negative.
    pub(crate) half_size: [f32; 2],
    pub(crate) area: Area,
    pub(crate) draws: Vec<Draw>,
    pub(crate) sources: Vec<DrawSource>,
    /// Of each draw, where a vertex shader projects.
    pub(crate) shader_draws: Vec<ShaderDraw>,
    /// The most Gaussians.
    pub(crate) gaussians: u64,
    /// Descriptor sets and push constants of a resolve shader, if there is one.
    pub(crate) bindings: Option<Arc<Bindings>>,
    /// Pixels in memory of their own, where they are shown by another command buffer.
    pub(crate) pixels: Option<Arc<Memory>>,
}

/// Places in the counters, as `shaders/counters.glsl` has them: numbers, and sizes of dispatches.
#[derive(Clone, Copy)]
enum Counter {
    Gaussians = 0,
    Seen = 1,
    Stored = 3,
    ByGaussian = 4,
    SortGaussians = 7,
    BySeen = 10,
    SortSeen = 13,
    ByPair = 16,
    SortPairs = 19,
}

/// A sort: two halves of keys and of values, and the number of keys.
#[derive(Clone, Copy)]
struct Sort {
    keys: u64,
    values: u64,
    /// Bytes from a half to the other.
    half: u64,
    count: Counter,
    groups: Counter,
}

impl Work {
    pub(crate) fn tiles(&self) -> [u32; 2] {
        self.area.size.map(|size| size.div_ceil(TILE))
    }

    /// The samples of a pixel that the set tells apart: those that are tested.
    pub(crate) fn samples(&self) -> u32 {
        if self.tests.is_some() { self.pipeline.samples } else { 1 }
    }

    /// The outcomes of samples that are stored.
    pub(crate) fn outcomes(&self) -> &'static [Outcome] {
        let has_stencil = self.tests.is_some_and(|tests| tests.is_stencil_tested);
        if has_stencil { &[Outcome::Passed, Outcome::Failed, Outcome::StencilFailed] } else { &[Outcome::Passed] }
    }

    /// The number of samples that are told apart, of all views.
    fn all_samples(&self) -> u64 {
        let pixels = u64::from(self.area.size[0]) * u64::from(self.area.size[1]);
        pixels * u64::from(self.pipeline.planes()) * u64::from(self.samples())
    }

    /// The number of tiles of all views.
    fn all_tiles(&self) -> u64 {
        let [across, down] = self.tiles();
        u64::from(across) * u64::from(down) * u64::from(self.pipeline.planes())
    }

    /// The places of what the set makes.
    pub(crate) fn made(&self) -> MadePlaces {
        let resolve = self.pipeline.resolve.as_ref();
        let planes = u64::from(self.pipeline.planes());
        MadePlaces::of(&MadeExtent {
            samples: self.all_samples(),
            has_medians: self.pipeline.tests.is_some(),
            tiles: self.all_tiles(),
            has_inputs: self.has_inputs(),
            cameras: if resolve.is_some_and(|resolve| resolve.has_camera) { planes } else { 0 },
            draws: if resolve.is_some() { u64::from(self.samples()) } else { 0 },
        })
    }

    /// A resolve shader reads depths or Gaussians.
    fn has_inputs(&self) -> bool {
        self.pipeline.variant.is_resolved
    }

    /// Reports whether the set depends on the depth attachment: on what it stores, or on its format.
    pub(crate) fn knows_attachment(&self) -> bool {
        self.tests.is_some() || self.has_inputs()
    }

    /// The attributes of the draws with a resolve shader: one for each sample.
    fn attributes(&self, next: &Next, address: u64) -> Vec<Attributes> {
        let Some(resolve) = &self.pipeline.resolve else {
            return Vec::new();
        };
        let all = Attributes::new(address, &self.made(), self.area, self.samples());
        let all = all.covering(resolve.covering, self.shown_size(next));
        (0..self.samples()).map(|sample| all.of_sample(sample)).collect()
    }

    /// The place of a draw's attributes.
    pub(crate) fn attributes_place(&self, made: &Made) -> u64 {
        made.place + self.made().attributes
    }

    /// Vertices of the draws with a resolve shader, of each tile.
    pub(crate) fn vertices_of_tile(&self) -> u32 {
        match self.covering() {
            Covering::Quads => 6,
            Covering::Pixels => 6 * TILE * TILE,
            Covering::Triangle => 3,
        }
    }

    fn covering(&self) -> Covering {
        self.pipeline.resolve.as_ref().map_or(Covering::Quads, |resolve| resolve.covering)
    }

    /// The size in pixels of the viewport of draws with a resolve shader. It is the area's, or has triangles that reach beyond tiles.
    pub(crate) fn shown_size(&self, next: &Next) -> [u32; 2] {
        let [across, down] = self.tiles();
        match self.covering() {
            Covering::Triangle => [
                (TILE * (across + 1)).min(next.max_viewport[0]).max(self.area.size[0]),
                (TILE * (down + 1)).min(next.max_viewport[1]).max(self.area.size[1]),
            ],
            _ => self.area.size,
        }
    }

    /// The set's result, for the shaders that show it.
    pub(crate) fn picture(&self, address: u64) -> Picture {
        let places = self.made();
        Picture {
            image: address,
            shown: address + places.shown,
            origin: self.area.origin,
            size: self.area.size,
            medians: address + places.medians,
            samples: self.samples(),
            sample: 0,
            wanted: Outcome::Passed.number(),
            unused: 0,
        }
    }

    fn camera_count(&self) -> u32 {
        match &self.cameras {
            Cameras::Command(cameras) => cameras.len() as u32,
            Cameras::Buffer(..) => self.pipeline.camera_buffer.as_ref().map_or(0, |camera| camera.count),
        }
    }

    /// The kernels that the set needs.
    fn variant(&self) -> Variant {
        let has_angles = match &self.cameras {
            Cameras::Command(cameras) => cameras.iter().any(|seen| seen.camera.model > ORTHOGRAPHIC),
            Cameras::Buffer(..) => true,
        };
        let has_lens = !self.lenses.is_empty();
        Variant { has_angles, has_lens, has_tests: self.tests.is_some(), ..self.pipeline.variant }
    }

    /// The sizes of the set's scratch. `pairs` is the most of them that any set has had.
    pub(crate) fn extent(&self, pairs: u64) -> Extent {
        let [across, down] = self.tiles().map(u64::from);
        // A guess that later frames correct: what does not fit is drawn slowly, not wrongly.
        let guess = (8 * self.gaussians + (1 << 20)).max(pairs + pairs / 4);
        let forced = std::env::var("GAURAST_EMULATION_PAIRS").ok().and_then(|value| value.parse().ok());
        Extent {
            gaussians: self.gaussians,
            pairs: forced.unwrap_or(guess).clamp(1, 1 << 27),
            tiles: across * down,
            parameters: size_of::<Parameters>() as u64,
            draws: size_of_val(self.draws.as_slice()) as u64,
            sources: size_of_val(self.sources.as_slice()).max(4) as u64,
            cameras: 128 * u64::from(self.camera_count().max(1)),
            lenses: size_of_val(self.lenses.as_slice()) as u64,
            pixels: if self.pixels.is_some() { 0 } else { self.made().end },
            outputs: self.draws.iter().map(|draw| self.bytes_of_outputs(draw)).sum(),
            tested: if self.tests.is_some() { self.all_samples() } else { 0 },
            has_inputs: self.has_inputs(),
            has_rectangles: self.pipeline.variant.is_surfel && self.pipeline.variant.has_cut_tiles,
        }
    }

    /// Bytes of what the projecting shader of a draw writes, for all views.
    fn bytes_of_outputs(&self, draw: &Draw) -> u64 {
        OUTPUTS * u64::from(draw.shaded.capacity) * u64::from(self.pipeline.planes())
    }

    /// The draws, with the addresses of what their projecting shader writes.
    fn draws_with_outputs(&self, first: u64) -> Vec<Draw> {
        let mut draws = self.draws.clone();
        if self.pipeline.projecting.is_some() {
            let mut at = first;
            for draw in &mut draws {
                draw.shaded.outputs = at;
                at += self.bytes_of_outputs(draw);
            }
        }
        draws
    }

    /// The place of what the set makes.
    pub(crate) fn made_in(&self, scratch: &Arc<Memory>, places: &Places) -> Made {
        let own = self.pixels.as_ref().map(|memory| Made { memory: Arc::clone(memory), place: 0 });
        own.unwrap_or_else(|| Made { memory: Arc::clone(scratch), place: places.pixels })
    }

    fn parameters(
        &self,
        scratch: &Arc<Memory>,
        places: &Places,
        extent: &Extent,
        feedback: u64,
        attachment: Option<&DepthStencil>,
    ) -> Parameters {
        let depth_compare = self.tests.filter(|tests| tests.is_depth_tested && has_depths(attachment));
        let at = |place: u64| scratch.address + place;
        let (pipeline, made) = (&self.pipeline, self.made_in(scratch, places).address());
        let (picture, made_places) = (self.picture(made), self.made());
        let sigma = &pipeline.sigma_points;
        let has_camera = pipeline.resolve.as_ref().is_some_and(|resolve| resolve.has_camera);
        Parameters {
            counters: at(places.counters),
            keys: at(places.keys),
            values: at(places.values),
            pair_keys: at(places.pair_keys),
            pair_values: at(places.pair_values),
            sums: at(places.sums),
            reached: at(places.reached),
            // The keys are not needed any more.
            before_each: at(places.keys),
            ranges: at(places.ranges),
            records: at(places.records),
            image: picture.image,
            shown: picture.shown,
            feedback,
            draws: at(places.draws),
            sources: at(places.sources),
            cameras: at(places.cameras),
            derived: at(places.derived),
            depths: at(places.depths),
            stored: at(places.stored),
            medians: picture.medians,
            names: at(places.names),
            inputs: made + made_places.inputs,
            seen_by: if has_camera { made + made_places.cameras } else { 0 },
            lenses: if self.lenses.is_empty() { 0 } else { at(places.lenses) },
            rectangles: at(places.rectangles),
            unused: [0; 2],
            area_origin: self.area.origin,
            area_size: self.area.size,
            viewport: self.viewport,
            tiles: self.tiles(),
            reserve: extent.gaussians as u32,
            pair_capacity: extent.pairs as u32,
            draw_count: self.draws.len() as u32,
            source_count: pipeline.sources.len() as u32,
            camera_count: self.camera_count(),
            degree: self.values.degree,
            order: self.values.order,
            compensated: u32::from(self.values.is_compensated),
            cut_off: pipeline.cut_off,
            harmonics_step: pipeline.harmonics_step,
            low_pass: self.values.low_pass,
            alpha_floor: self.values.alpha_floor,
            alpha_ceiling: self.values.alpha_ceiling,
            transmittance_floor: self.values.transmittance_floor,
            compensation_floor: pipeline.compensation_floor,
            cut_off_deviations: pipeline.cut_off_deviations,
            is_surfel: u32::from(pipeline.variant.is_surfel),
            depth_compare: depth_compare
                .map_or(vk::CompareOp::ALWAYS, |tests| tests.depth_compare)
                .as_raw()
                .cast_unsigned(),
            depth_range: self.depth_range,
            depth_steps: depth_steps(attachment),
            is_negative_one_to_one: u32::from(pipeline.is_negative_one_to_one),
            sigma_distance: pair(sigma.distance),
            sigma_center: pair(sigma.center),
            sigma_other: pair(sigma.other),
            picture: sigma.picture(self.viewport[2], self.viewport[3]).map(pair),
            must_count: sigma.must_count,
            is_shaded: u32::from(pipeline.projecting.is_some()),
            center: self.center.map(pair),
            half_size: self.half_size,
            attributes: pipeline.attributes,
            decodings: pipeline.decodings.word,
        }
    }

    /// Records the set's dispatches, outside of a render pass.
    ///
    /// # Safety
    /// The command buffer is being recorded, and the scratch is as large as the places say.
    pub(crate) unsafe fn record(
        &self,
        next: &Arc<Next>,
        kernels: &Kernels,
        commands: vk::CommandBuffer,
        scratch: &Arc<Memory>,
        extent: &Extent,
        attachment: Option<&DepthStencil>,
    ) -> Result<Option<Times>, vk::Result> {
        let specialized = kernels.specialized(self.variant())?;
        let places = Places::of(extent);
        let parameters = self.parameters(scratch, &places, extent, kernels.feedback.address, attachment);
        // SAFETY: the caller's promise, for all below.
        unsafe {
            let times = Times::begin(next, commands);
            let mut run = Run { next, kernels, commands, scratch, extent, places, specialized, times };
            run.barrier();
            run.write(places.parameters, bytemuck::bytes_of(&parameters));
            let draws = self.draws_with_outputs(scratch.address + places.outputs);
            run.write(places.draws, bytemuck::cast_slice(&draws));
            if extent.outputs > 0 {
                // What is not written is no number, and draws nothing.
                next.cmd_fill_buffer(commands, scratch.buffer, places.outputs, extent.outputs, !0);
            }
            run.write(places.sources, bytemuck::cast_slice(&self.sources));
            match &self.cameras {
                Cameras::Command(cameras) => {
                    let cameras: Vec<Camera> = cameras.iter().map(|seen| seen.camera).collect();
                    run.write(places.cameras, bytemuck::cast_slice(&cameras));
                    run.write(places.lenses, bytemuck::cast_slice(&self.lenses));
                }
                Cameras::Buffer(set, offsets) => self.copy_cameras(&run, *set, offsets),
            }
            let made = self.made_in(scratch, &places);
            let shown = made.place + self.made().shown;
            next.cmd_fill_buffer(commands, made.memory.buffer, shown, 4 * self.all_tiles(), 0);
            let attributes = self.attributes(next, made.address());
            if !attributes.is_empty() {
                let at = self.attributes_place(&made);
                next.cmd_update_buffer(commands, made.memory.buffer, at, bytemuck::cast_slice(&attributes));
            }
            if let Some(tests) = &self.tests {
                self.test(&run, tests, attachment)?;
                run.end_stage("test");
            }
            for (index, view) in self.pipeline.views().enumerate() {
                self.record_view(&mut run, view, index == 0);
            }
            run.barrier();
            Ok(run.times)
        }
    }

    /// # Safety
    /// As [`Self::record`].
    unsafe fn copy_cameras(&self, run: &Run<'_>, set: vk::DescriptorSet, offsets: &[u32]) {
        let Some(camera) = &self.pipeline.camera_buffer else {
            return;
        };
        let copied = run.scratch.address + run.places.cameras;
        let compute = vk::PipelineBindPoint::COMPUTE;
        // SAFETY: the caller's promise.
        unsafe {
            let (next, commands) = (run.next, run.commands);
            next.cmd_bind_pipeline(commands, compute, camera.pipeline);
            next.cmd_bind_descriptor_sets(commands, compute, camera.layout, camera.set, &[set], offsets);
            let stages = vk::ShaderStageFlags::COMPUTE;
            next.cmd_push_constants(commands, camera.layout, stages, 0, bytemuck::bytes_of(&copied));
            next.cmd_dispatch(commands, 1, 1, 1);
        }
    }

    /// Makes the tests that Gaussians take no part in, and keeps the depths of samples.
    ///
    /// # Safety
    /// As [`Self::record`].
    unsafe fn test(
        &self,
        run: &Run<'_>,
        tests: &TestState,
        attachment: Option<&DepthStencil>,
    ) -> Result<(), vk::Result> {
        let aspects = attachment.map_or(vk::ImageAspectFlags::empty(), |attachment| attachment.aspects);
        let wanted = |is_tested: bool, aspect: vk::ImageAspectFlags| {
            if is_tested { aspects & aspect } else { vk::ImageAspectFlags::empty() }
        };
        let depth = wanted(tests.is_depth_tested || tests.are_bounds_tested, vk::ImageAspectFlags::DEPTH);
        let stencil = wanted(tests.is_stencil_tested, vk::ImageAspectFlags::STENCIL);
        let has_samples = self.samples() > 1;
        let depth_steps = depth_steps(attachment);
        let at = |place: u64| run.scratch.address + place;
        let state = &tests.stencil;
        let pushed = PushedTests {
            stored: at(run.places.stored),
            depths: at(run.places.copied_depths),
            stencils: at(run.places.copied_stencils),
            count: self.all_samples() as u32,
            depth_bytes: if depth.is_empty() {
                0
            } else if depth_steps == 0xFFFF && !has_samples {
                2
            } else {
                4
            },
            depth_steps,
            stencil_bytes: if stencil.is_empty() {
                0
            } else if has_samples {
                4
            } else {
                1
            },
            bounds: if tests.are_bounds_tested && !depth.is_empty() { tests.bounds } else { [1.0, 0.0] },
            stencil_compare: state.compare_op.as_raw().cast_unsigned()
                | (state.compare_mask & 0xFF) << 8
                | (state.reference & 0xFF) << 16,
            are_floats: u32::from(has_samples),
        };
        // SAFETY: the caller's promise.
        unsafe {
            if let Some(attachment) = attachment.filter(|_| !(depth | stencil).is_empty()) {
                run.transition(attachment, true);
                for (aspect, place) in [(depth, run.places.copied_depths), (stencil, run.places.copied_stencils)] {
                    if aspect.is_empty() {
                        continue;
                    }
                    if has_samples {
                        self.copy_samples(run, attachment, aspect, place)?;
                    } else {
                        self.copy_aspect(run, attachment, aspect, place);
                    }
                }
                run.transition(attachment, false);
            }
            let groups = (self.all_samples() as u32).div_ceil(256);
            let wide = groups.min(32768);
            run.dispatch(run.kernels.pipeline(Kernel::Tests), &pushed, [wide, groups.div_ceil(wide)]);
        }
        Ok(())
    }

    /// Copies an aspect of the area, of one sample a pixel, to scratch.
    ///
    /// # Safety
    /// As [`Self::record`].
    unsafe fn copy_aspect(&self, run: &Run<'_>, attachment: &DepthStencil, aspect: vk::ImageAspectFlags, place: u64) {
        let view = &attachment.view;
        let [x, y] = self.area.origin;
        let [width, height] = self.area.size;
        let copy = vk::BufferImageCopy {
            buffer_offset: place,
            buffer_row_length: 0,
            buffer_image_height: 0,
            image_subresource: vk::ImageSubresourceLayers {
                aspect_mask: aspect,
                mip_level: view.level,
                base_array_layer: view.layer,
                layer_count: self.pipeline.planes().min(view.layers),
            },
            image_offset: vk::Offset3D { x, y, z: 0 },
            image_extent: vk::Extent3D { width, height, depth: 1 },
        };
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        // SAFETY: the caller's promise.
        unsafe { run.next.cmd_copy_image_to_buffer(run.commands, view.handle, layout, run.scratch.buffer, &[copy]) };
    }

    /// Copies an aspect of the area, of several samples a pixel, to scratch.
    ///
    /// # Safety
    /// As [`Self::record`].
    unsafe fn copy_samples(
        &self,
        run: &Run<'_>,
        attachment: &DepthStencil,
        aspect: vk::ImageAspectFlags,
        place: u64,
    ) -> Result<(), vk::Result> {
        let samples = &run.kernels.samples;
        let reader = attachment.view.reader(run.next, samples.set_layout, aspect)?;
        let kernel = if aspect == vk::ImageAspectFlags::DEPTH { samples.depths } else { samples.stencils };
        let pushed = PushedSamples {
            copied: run.scratch.address + place,
            area_origin: self.area.origin,
            area_size: self.area.size,
            samples: self.samples(),
            unused: 0,
        };
        let compute = vk::PipelineBindPoint::COMPUTE;
        let [across, down] = self.tiles();
        let layers = self.pipeline.planes().min(attachment.view.layers);
        // SAFETY: the caller's promise.
        unsafe {
            let (next, commands) = (run.next, run.commands);
            next.cmd_bind_pipeline(commands, compute, kernel);
            next.cmd_bind_descriptor_sets(commands, compute, samples.layout, 0, &[reader.set], &[]);
            let stages = vk::ShaderStageFlags::COMPUTE;
            next.cmd_push_constants(commands, samples.layout, stages, 0, bytemuck::bytes_of(&pushed));
            next.cmd_dispatch(commands, across, down, layers);
        }
        Ok(())
    }

    /// Runs the projecting shader of each draw, for all views.
    ///
    /// # Safety
    /// As [`Self::record`].
    unsafe fn shade(&self, run: &Run<'_>, projecting: &Projecting) {
        let (next, commands, scratch) = (run.next, run.commands, run.scratch.buffer);
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width: 1, height: 1 } };
        let rendering =
            vk::RenderingInfo::default().render_area(area).layer_count(1).view_mask(self.pipeline.view_mask);
        let mut bound = BTreeMap::new();
        // SAFETY: the caller's promise: the application has bound all that is bound here in this command buffer, or in the secondary one
        // that the set is of.
        unsafe {
            run.barrier();
            next.cmd_begin_rendering(commands, &rendering);
            next.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, projecting.raw);
            for (index, draw) in self.shader_draws.iter().enumerate() {
                draw.bindings.push_constants(next, commands);
                draw.bindings.bind_sets(next, commands, &bound);
                bound.clone_from(&draw.bindings.sets);
                for (&binding, buffer) in &draw.vertex_buffers {
                    buffer.bind(next, commands, binding);
                }
                let place = run.places.draws + (index * size_of::<Draw>()) as u64;
                let strides = projecting.has_dynamic_strides.then_some(&[0_u64][..]);
                next.cmd_bind_vertex_buffers2(commands, projecting.binding, &[scratch], &[place], None, strides);
                let call = &draw.call;
                if let Some(index) = &draw.index_buffer {
                    next.cmd_bind_index_buffer(commands, index.buffer, index.offset, index.ty);
                }
                match (call.parameters != 0, call.is_indexed) {
                    (false, false) => {
                        next.cmd_draw(commands, call.count, call.instances, call.first, call.first_instance);
                    }
                    (false, true) => next.cmd_draw_indexed(
                        commands,
                        call.count,
                        call.instances,
                        call.first,
                        call.vertex_offset,
                        call.first_instance,
                    ),
                    (true, false) => next.cmd_draw_indirect(commands, scratch, place + COMMAND, 1, 0),
                    (true, true) => next.cmd_draw_indexed_indirect(commands, scratch, place + COMMAND, 1, 0),
                }
            }
            next.cmd_end_rendering(commands);
            run.barrier();
        }
    }

    /// # Safety
    /// As [`Self::record`].
    unsafe fn record_view(&self, run: &mut Run<'_>, view: u32, is_first: bool) {
        let [across, down] = self.tiles();
        let tiles = across * down;
        let plane = view * self.samples() * self.area.size[0] * self.area.size[1];
        let pushed = Pushed { set: run.scratch.address + run.places.parameters, view, side: 0, plane, unused: 0 };
        let (places, specialized) = (run.places, run.specialized);
        let by_depth = Sort {
            keys: run.scratch.address + places.keys,
            values: run.scratch.address + places.values,
            half: 4 * run.extent.gaussians,
            count: Counter::Seen,
            groups: Counter::SortSeen,
        };
        let by_tile = Sort {
            keys: run.scratch.address + places.pair_keys,
            values: run.scratch.address + places.pair_values,
            half: 4 * run.extent.pairs,
            count: Counter::Stored,
            groups: Counter::SortPairs,
        };
        // SAFETY: the caller's promise.
        unsafe {
            run.barrier();
            run.next.cmd_fill_buffer(run.commands, run.scratch.buffer, run.places.ranges, 8 * u64::from(tiles), 0);
            run.one(Kernel::Prepare, pushed);
            run.end_stage("prepare");
            if let (Some(projecting), true) = (&self.pipeline.projecting, is_first) {
                self.shade(run, projecting);
                run.end_stage("vertex shader");
            }
            run.indirect(specialized.project, &pushed, Counter::ByGaussian);
            run.end_stage("project");
            // What is not seen falls out with the first digit.
            let unseen = Sort { count: Counter::Gaussians, groups: Counter::SortGaussians, ..by_depth };
            run.digit(unseen, 0, true);
            for digit in 1..4 {
                run.digit(by_depth, digit, false);
            }
            run.end_stage("sort by depth");
            run.indirect(run.kernels.pipeline(Kernel::ScanTiles), &pushed, Counter::SortSeen);
            run.one(Kernel::CountPairs, pushed);
            run.indirect(run.kernels.pipeline(Kernel::Emit), &pushed, Counter::BySeen);
            run.end_stage("pairs");
            let digits = (u32::BITS - (tiles - 1).leading_zeros()).div_ceil(8).max(1);
            for digit in 0..digits {
                run.digit(by_tile, digit, false);
            }
            run.end_stage("sort by tile");
            let sorted = Pushed { side: digits & 1, ..pushed };
            run.indirect(run.kernels.pipeline(Kernel::Ranges), &sorted, Counter::ByPair);
            run.end_stage("ranges");
            run.bind(specialized.raster, &sorted);
            run.next.cmd_dispatch(run.commands, across, down, self.samples());
            run.end_stage("rasterize");
        }
    }
}

/// Reports whether there is an attachment of depths.
fn has_depths(attachment: Option<&DepthStencil>) -> bool {
    attachment.is_some_and(|attachment| attachment.aspects.contains(vk::ImageAspectFlags::DEPTH))
}

/// The greatest depth of an attachment in steps; 0 if depths are floats.
fn depth_steps(attachment: Option<&DepthStencil>) -> u32 {
    let attachment = attachment.filter(|attachment| attachment.aspects.contains(vk::ImageAspectFlags::DEPTH));
    attachment.map_or(0, |attachment| (1 << attachments::depth_bits(attachment.view.image.format)) - 1)
}

/// The place in which dispatches are recorded.
struct Run<'a> {
    next: &'a Arc<Next>,
    kernels: &'a Kernels,
    commands: vk::CommandBuffer,
    scratch: &'a Memory,
    extent: &'a Extent,
    places: Places,
    specialized: Specialized,
    times: Option<Times>,
}

impl Run<'_> {
    /// Notes that a stage ends.
    ///
    /// # Safety
    /// The command buffer is being recorded, outside of a render pass; here and below.
    unsafe fn end_stage(&mut self, stage: &'static str) {
        if let Some(times) = &mut self.times {
            // SAFETY: the caller's promise.
            unsafe { times.end_stage(self.commands, stage) };
        }
    }

    /// All that was written before is there for what follows.
    unsafe fn barrier(&self) {
        // SAFETY: the caller's promise.
        unsafe { barrier(self.next, self.commands) };
    }

    /// Makes an attachment readable, or an attachment again.
    unsafe fn transition(&self, attachment: &DepthStencil, is_to_be_read: bool) {
        let view = &attachment.view;
        let read = if view.image.samples > 1 { attachments::READ } else { vk::ImageLayout::TRANSFER_SRC_OPTIMAL };
        let barriers: Vec<vk::ImageMemoryBarrier<'_>> = attachment
            .layouts
            .iter()
            .map(|&(aspects, layout)| {
                let (from, to) = if is_to_be_read { (layout, read) } else { (read, layout) };
                let range = vk::ImageSubresourceRange {
                    aspect_mask: aspects,
                    base_mip_level: view.level,
                    level_count: 1,
                    base_array_layer: view.layer,
                    layer_count: view.layers,
                };
                vk::ImageMemoryBarrier::default()
                    .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
                    .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)
                    .old_layout(from)
                    .new_layout(to)
                    .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .image(view.handle)
                    .subresource_range(range)
            })
            .collect();
        let all = vk::PipelineStageFlags::ALL_COMMANDS;
        let flags = vk::DependencyFlags::empty();
        // SAFETY: the caller's promise.
        unsafe { self.next.cmd_pipeline_barrier(self.commands, all, all, flags, &[], &[], &barriers) };
    }

    /// Between kernels.
    unsafe fn kernel_barrier(&self) {
        use vk::AccessFlags as Access;
        use vk::PipelineStageFlags as Stages;
        let barriers = [vk::MemoryBarrier::default()
            .src_access_mask(Access::SHADER_WRITE | Access::TRANSFER_WRITE)
            .dst_access_mask(Access::SHADER_READ | Access::SHADER_WRITE | Access::INDIRECT_COMMAND_READ)];
        let (from, to) = (Stages::COMPUTE_SHADER | Stages::TRANSFER, Stages::COMPUTE_SHADER | Stages::DRAW_INDIRECT);
        let flags = vk::DependencyFlags::empty();
        // SAFETY: the caller's promise.
        unsafe { self.next.cmd_pipeline_barrier(self.commands, from, to, flags, &barriers, &[], &[]) };
    }

    /// Writes bytes to scratch; at most 65,536 by a command.
    unsafe fn write(&self, place: u64, bytes: &[u8]) {
        for (index, part) in bytes.chunks(65536).enumerate() {
            let at = place + 65536 * index as u64;
            // SAFETY: the caller's promise.
            unsafe { self.next.cmd_update_buffer(self.commands, self.scratch.buffer, at, part) };
        }
    }

    unsafe fn bind<P: bytemuck::Pod>(&self, pipeline: vk::Pipeline, pushed: &P) {
        let stages = vk::ShaderStageFlags::COMPUTE;
        // SAFETY: the caller's promise.
        unsafe {
            self.kernel_barrier();
            self.next.cmd_bind_pipeline(self.commands, vk::PipelineBindPoint::COMPUTE, pipeline);
            let bytes = bytemuck::bytes_of(pushed);
            self.next.cmd_push_constants(self.commands, self.kernels.layout, stages, 0, bytes);
        }
    }

    unsafe fn dispatch<P: bytemuck::Pod>(&self, pipeline: vk::Pipeline, pushed: &P, [x, y]: [u32; 2]) {
        // SAFETY: the caller's promise.
        unsafe {
            self.bind(pipeline, pushed);
            self.next.cmd_dispatch(self.commands, x, y, 1);
        }
    }

    unsafe fn one(&self, kernel: Kernel, pushed: Pushed) {
        // SAFETY: the caller's promise.
        unsafe { self.dispatch(self.kernels.pipeline(kernel), &pushed, [1, 1]) };
    }

    unsafe fn indirect<P: bytemuck::Pod>(&self, pipeline: vk::Pipeline, pushed: &P, groups: Counter) {
        // SAFETY: the caller's promise.
        unsafe {
            self.bind(pipeline, pushed);
            let at = self.places.counters + 4 * groups as u64;
            self.next.cmd_dispatch_indirect(self.commands, self.scratch.buffer, at);
        }
    }

    /// A digit of a sort.
    unsafe fn digit(&self, sort: Sort, digit: u32, is_first_of_depths: bool) {
        let at = |place: u64| self.scratch.address + place;
        let (from, to) = if digit.is_multiple_of(2) { (0, sort.half) } else { (sort.half, 0) };
        let pushed = PushedDigit {
            keys: sort.keys + from,
            values: sort.values + from,
            sorted_keys: sort.keys + to,
            sorted_values: sort.values + to,
            histogram: at(self.places.histogram),
            totals: at(self.places.totals),
            counters: at(self.places.counters),
            shift: 8 * digit,
            count_place: sort.count as u32,
            is_first_of_depths: u32::from(is_first_of_depths),
            unused: 0,
        };
        // SAFETY: the caller's promise.
        unsafe {
            self.indirect(self.kernels.pipeline(Kernel::Histogram), &pushed, sort.groups);
            self.dispatch(self.kernels.pipeline(Kernel::ScanDigits), &pushed, [256, 1]);
            self.indirect(self.kernels.pipeline(Kernel::Scatter), &pushed, sort.groups);
        }
    }
}

/// All that was written before is there for what follows.
///
/// # Safety
/// The command buffer is being recorded, outside of a render pass.
pub(crate) unsafe fn barrier(next: &Next, commands: vk::CommandBuffer) {
    let barriers = [vk::MemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
        .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)];
    let all = vk::PipelineStageFlags::ALL_COMMANDS;
    // SAFETY: the caller's promise.
    unsafe { next.cmd_pipeline_barrier(commands, all, all, vk::DependencyFlags::empty(), &barriers, &[], &[]) };
}
