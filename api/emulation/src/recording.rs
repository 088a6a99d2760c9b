//! Command buffers that are being recorded: their state, and the recording of their sets.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;
use gaurast::vk::GaussianCameraSourceGAURAST as CameraSource;

use crate::bindings::{Bindings, BoundSet, PushConstants};
use crate::cameras::{Cameras, SeenBy};
use crate::decoding::Tables;
use crate::depth_stencil::{Outcome, TestState};
use crate::draw_call::{Call, Draw, IndexBuffer, Shaded, ShaderDraw, VertexBuffer};
use crate::emulation::Emulation;
use crate::formats;
use crate::made::Made;
use crate::next::Next;
use crate::pass::Pass;
use crate::pipeline::Pipeline;
use crate::report::tell;
use crate::scratch::{Memory, Places};
use crate::set::{DynamicValues, Set, SetState};
use crate::support::MAX_GAUSSIANS;
use crate::times::Times;
use crate::work::{DrawSource, Work, barrier};

/// The graphics pipeline that is bound.
#[derive(Clone, Default)]
pub(crate) enum Bound {
    #[default]
    Nothing,
    Other(vk::Pipeline),
    Gaussians(Arc<Pipeline>),
}

/// The buffer of spherical harmonics.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HarmonicsBuffer {
    pub(crate) address: u64,
    pub(crate) size: u64,
    pub(crate) format: vk::Format,
    pub(crate) stride: u32,
    pub(crate) coefficient_stride: u64,
}

/// A query that the application has begun within a pass.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Query {
    pub(crate) pool: vk::QueryPool,
    pub(crate) index: u32,
    pub(crate) flags: vk::QueryControlFlags,
    /// It has begun on the device: something has been drawn since.
    pub(crate) is_active: bool,
}

/// Conditional rendering that has begun within a pass.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Condition {
    pub(crate) buffer: vk::Buffer,
    pub(crate) offset: u64,
    pub(crate) flags: vk::ConditionalRenderingFlagsEXT,
}

/// The least number of Gaussians, or of vertices, that a draw has room for where its own is not known.
const LEAST_GUESS: u64 = 1 << 18;

/// A command that sets dynamic state, for repeating it.
pub(crate) type Repeat = Box<dyn Fn(&Next, vk::CommandBuffer) + Send>;

/// A command buffer.
pub(crate) struct Recording {
    pub(crate) commands: vk::CommandBuffer,
    pub(crate) family: u32,
    pub(crate) pass: Option<Pass>,
    pub(crate) graphics: Bound,
    pub(crate) compute: vk::Pipeline,
    pub(crate) vertex_buffers: BTreeMap<u32, VertexBuffer>,
    pub(crate) index_buffer: Option<IndexBuffer>,
    pub(crate) harmonics: Option<HarmonicsBuffer>,
    pub(crate) tables: Option<Tables>,
    pub(crate) cameras: Vec<SeenBy>,
    pub(crate) values: DynamicValues,
    /// Depth and stencil tests, as commands have set them.
    pub(crate) tests: TestState,
    /// Attachments may have changed since the recording began.
    pub(crate) has_drawn: bool,
    pub(crate) viewport: Option<vk::Viewport>,
    pub(crate) scissor: Option<vk::Rect2D>,
    /// Vulkan's dynamic states, by their values as `VkDynamicState`.
    pub(crate) states: BTreeMap<i32, Repeat>,
    pub(crate) constants: Vec<PushConstants>,
    /// By bind point and number.
    pub(crate) descriptors: BTreeMap<(i32, u32), BoundSet>,
    pub(crate) is_in_set: bool,
    set: Option<Set>,
    pub(crate) queries: Vec<Query>,
    pub(crate) condition: Option<Condition>,
    /// The sets of a secondary command buffer, which are computed where it is executed.
    works: Vec<Work>,
    /// Memory that recorded commands use.
    scratch: Option<Arc<Memory>>,
    kept: Vec<Arc<Memory>>,
    times: Vec<Times>,
    pub(crate) failure: Option<vk::Result>,
}

impl Recording {
    pub(crate) fn new(commands: vk::CommandBuffer, family: u32) -> Self {
        Self {
            commands,
            family,
            pass: None,
            graphics: Bound::Nothing,
            compute: vk::Pipeline::null(),
            vertex_buffers: BTreeMap::new(),
            index_buffer: None,
            harmonics: None,
            tables: None,
            cameras: Vec::new(),
            values: DynamicValues::default(),
            tests: TestState::default(),
            has_drawn: false,
            viewport: None,
            scissor: None,
            states: BTreeMap::new(),
            constants: Vec::new(),
            descriptors: BTreeMap::new(),
            is_in_set: false,
            set: None,
            queries: Vec::new(),
            condition: None,
            works: Vec::new(),
            scratch: None,
            kept: Vec::new(),
            times: Vec::new(),
            failure: None,
        }
    }

    /// Forgets all that was recorded.
    pub(crate) fn reset(&mut self) {
        *self = Self::new(self.commands, self.family);
    }

    /// Remembers push constants; those of the same place are replaced.
    pub(crate) fn push_constants(&mut self, pushed: PushConstants) {
        self.constants.retain(|other| {
            (other.layout, other.stages, other.offset, other.bytes.len())
                != (pushed.layout, pushed.stages, pushed.offset, pushed.bytes.len())
        });
        self.constants.push(pushed);
    }

    /// Makes the queries begin that the application has begun.
    ///
    /// # Safety
    /// The command buffer is being recorded, here and below.
    pub(crate) unsafe fn activate_queries(&mut self, next: &Next) {
        for query in self.queries.iter_mut().filter(|query| !query.is_active) {
            query.is_active = true;
            // SAFETY: the application has begun it.
            unsafe { next.cmd_begin_query(self.commands, query.pool, query.index, query.flags) };
        }
    }

    /// The state of a draw of Gaussians; `None` where the text says that it draws nothing.
    fn state(&self, pipeline: &Arc<Pipeline>) -> Option<SetState> {
        let cameras = if pipeline.projecting.is_some() {
            Cameras::Command(Vec::new())
        } else if pipeline.state.camera_source == CameraSource::UNIFORM_BUFFER {
            let number = pipeline.camera_buffer.as_ref()?.set;
            let bound = self.descriptors.get(&(vk::PipelineBindPoint::GRAPHICS.as_raw(), number))?;
            Cameras::Buffer(bound.set, bound.offsets.clone())
        } else {
            let is_enough = self.cameras.len() == 1 || self.cameras.len() >= pipeline.planes() as usize;
            if self.cameras.is_empty() || !is_enough {
                return None;
            }
            // No disc is seen through a lens that distorts.
            let mut views = pipeline.views().map(|view| &self.cameras[(view as usize).min(self.cameras.len() - 1)]);
            if pipeline.variant.is_surfel && views.any(|seen| seen.lens.is_some()) {
                return None;
            }
            Cameras::Command(self.cameras.clone())
        };
        if pipeline.has_harmonics_buffer() {
            self.harmonics?;
        }
        Some(SetState {
            values: self.values.of(pipeline)?,
            tests: pipeline
                .tests
                .map(|own| own.with_dynamic(&self.tests, &pipeline.dynamic))
                .filter(TestState::tests_anything),
            pipeline: Arc::clone(pipeline),
            cameras,
            viewport: pipeline.viewport.or(self.viewport)?,
            scissor: pipeline.scissor.or(self.scissor)?,
            bindings: pipeline.resolve.as_ref().map(|_| Arc::new(self.bindings())),
        })
    }

    fn bindings(&self) -> Bindings {
        let graphics = vk::PipelineBindPoint::GRAPHICS.as_raw();
        let sets = self.descriptors.iter().filter(|((point, _), _)| *point == graphics);
        let sets = sets.map(|((_, number), bound)| (*number, bound.clone())).collect();
        Bindings { sets, constants: self.constants.clone() }
    }

    /// The vertex buffers of a draw.
    fn sources(&self, pipeline: &Pipeline) -> Vec<DrawSource> {
        let stride_is_dynamic = pipeline.is_dynamic(vk::DynamicState::VERTEX_INPUT_BINDING_STRIDE);
        let source = |source: &crate::pipeline::Source| {
            let buffer = self.vertex_buffers.get(&source.binding).copied().unwrap_or_default();
            let stride = if stride_is_dynamic { buffer.stride.unwrap_or(source.stride) } else { source.stride };
            DrawSource {
                address: buffer.address,
                bytes: u32::try_from(buffer.size).unwrap_or(u32::MAX),
                stride,
                divisor: source.divisor.unwrap_or(u32::MAX),
                unused: 0,
            }
        };
        pipeline.sources.iter().map(source).collect()
    }

    /// The most elements that the vertex buffers of a draw have, by vertex or by instance.
    fn elements(pipeline: &Pipeline, sources: &[DrawSource], by_instance: bool) -> Option<u64> {
        let all = sources.iter().zip(&pipeline.sources);
        let own = all.filter(|(_, source)| match source.divisor {
            None => !by_instance,
            Some(divisor) => by_instance && divisor != 0,
        });
        own.map(|(source, of)| u64::from(source.bytes / source.stride.max(1)) * u64::from(of.divisor.unwrap_or(1)))
            .max()
    }

    /// The most Gaussians of a draw. That of an indirect one is not known here: it is taken from the sizes of what it reads.
    fn most(&self, call: &Call, pipeline: &Pipeline, sources: &[DrawSource]) -> u64 {
        if call.parameters == 0 {
            return (u64::from(call.count) * u64::from(call.instances)).min(u64::from(MAX_GAUSSIANS));
        }
        let indices = self.index_buffer.filter(|_| call.is_indexed);
        let vertices = indices
            .map(|buffer| buffer.size / u64::from(buffer.bytes))
            .or_else(|| Self::elements(pipeline, sources, false));
        let guess = vertices.unwrap_or(1) * Self::elements(pipeline, sources, true).unwrap_or(1);
        guess.clamp(LEAST_GUESS, u64::from(MAX_GAUSSIANS))
    }

    /// The room for what the projecting shader of a draw of at most as many Gaussians writes. With indices it has a place for each vertex
    /// of the buffers.
    fn shaded(call: &Call, pipeline: &Pipeline, sources: &[DrawSource], gaussians: u64) -> Shaded {
        let (mut vertices, mut capacity) = (0, gaussians);
        if call.is_indexed {
            vertices = Self::elements(pipeline, sources, false).unwrap_or(LEAST_GUESS).max(1);
            let of_buffers = || Self::elements(pipeline, sources, true).unwrap_or(1);
            capacity = vertices * if call.parameters == 0 { u64::from(call.instances) } else { of_buffers() };
        }
        if capacity > u64::from(MAX_GAUSSIANS) {
            tell(
                "an indexed draw with a projecting shader names more than 16,777,215 vertices of instances: later instances are not drawn",
            );
        }
        let [vertices, capacity] = [vertices, capacity].map(|most| most.min(u64::from(MAX_GAUSSIANS)) as u32);
        Shaded::with_room(vertices, capacity)
    }

    /// Records a draw of Gaussians.
    ///
    /// # Safety
    /// See [`Self::activate_queries`].
    pub(crate) unsafe fn draw(&mut self, emulation: &Emulation, pipeline: &Arc<Pipeline>, call: Call) {
        let Some(state) = self.state(pipeline) else {
            return;
        };
        if self.set.as_ref().is_some_and(|set| !set.state.is_shared_with(&state)) {
            return;
        }
        let index = if call.is_indexed { self.index_buffer } else { None };
        if call.is_indexed && index.is_none() {
            return;
        }
        let Some(tables) = pipeline.decodings.tables(self.tables.as_ref()) else {
            return;
        };
        let harmonics = self.harmonics.filter(|_| pipeline.has_harmonics_buffer());
        let sources = self.sources(pipeline);
        let gaussians = self.most(&call, pipeline, &sources);
        let draw = Draw {
            indices: index.map_or(0, |index| index.address),
            index_bytes: index.map_or(0, |index| index.bytes),
            index_count: index
                .map_or(0, |index| u32::try_from(index.size / u64::from(index.bytes)).unwrap_or(u32::MAX)),
            first: call.first,
            count: call.count,
            vertex_offset: call.vertex_offset,
            first_instance: call.first_instance,
            instances: call.instances,
            base: 0,
            indirect_index: call.indirect_index,
            is_indexed: u32::from(call.is_indexed),
            parameters: call.parameters,
            draw_count: call.draw_count,
            harmonics: harmonics.map_or(0, |buffer| buffer.address),
            harmonics_bytes: harmonics.map_or(0, |buffer| u32::try_from(buffer.size).unwrap_or(u32::MAX)),
            harmonics_format: harmonics
                .and_then(|buffer| formats::code(buffer.format))
                .filter(|code| !formats::has_integers(*code))
                .unwrap_or(0),
            harmonics_stride: harmonics.map_or(0, |buffer| buffer.stride),
            harmonics_coefficient_stride: harmonics
                .map_or(0, |buffer| u32::try_from(buffer.coefficient_stride).unwrap_or(u32::MAX)),
            shaded: match &pipeline.projecting {
                Some(_) => Self::shaded(&call, pipeline, &sources, gaussians),
                None => Shaded::default(),
            },
            tables,
        };
        let shader_draw = pipeline.projecting.as_ref().map(|_| ShaderDraw {
            call,
            bindings: Arc::new(self.bindings()),
            vertex_buffers: self.vertex_buffers.clone(),
            index_buffer: index,
        });
        let set = self.set.get_or_insert_with(|| Set::new(state));
        set.push(draw, &sources, gaussians);
        set.shader_draws.extend(shader_draw);
        if !self.is_in_set {
            // SAFETY: the caller's promise.
            unsafe { self.end_set(emulation) };
        }
    }

    /// Records what makes and shows the set.
    ///
    /// # Safety
    /// See [`Self::activate_queries`].
    pub(crate) unsafe fn end_set(&mut self, emulation: &Emulation) {
        let (Some(set), Some(pass)) = (self.set.take(), &self.pass) else {
            return;
        };
        let Some(work) = set.into_work(pass.area()) else {
            return;
        };
        // SAFETY: the caller's promise.
        let recorded = unsafe {
            if matches!(pass, Pass::Inherited) { self.defer(emulation, work) } else { self.compute(emulation, work) }
        };
        if let Err(error) = recorded {
            self.failure = Some(error);
        }
    }

    /// Shows a set of a secondary command buffer, which the primary one computes before.
    ///
    /// # Safety
    /// See [`Self::activate_queries`].
    unsafe fn defer(&mut self, emulation: &Emulation, mut work: Work) -> Result<(), vk::Result> {
        if work.tests.is_some() && self.has_drawn {
            tell(
                "in a secondary command buffer nothing may be drawn before Gaussians whose depths or stencils are tested",
            );
            return Err(vk::Result::ERROR_FEATURE_NOT_PRESENT);
        }
        self.has_drawn = true;
        let pixels = Arc::new(Memory::new(&emulation.next, work.made().end, false)?);
        self.kept.push(Arc::clone(&pixels));
        work.pixels = Some(Arc::clone(&pixels));
        // SAFETY: the caller's promise.
        unsafe { self.show(emulation, &work, &Made { memory: pixels, place: 0 })? };
        self.works.push(work);
        Ok(())
    }

    /// Breaks the pass, computes a set, and shows it.
    ///
    /// # Safety
    /// See [`Self::activate_queries`].
    unsafe fn compute(&mut self, emulation: &Emulation, work: Work) -> Result<(), vk::Result> {
        // SAFETY: the caller's promise.
        unsafe {
            match self.between(emulation, std::slice::from_ref(&work))? {
                Some(made) => self.show(emulation, &work, &made),
                None => Ok(()),
            }
        }
    }

    /// Breaks the pass for the dispatches of sets. Returns what the last one makes.
    ///
    /// # Safety
    /// See [`Self::activate_queries`].
    unsafe fn between(&mut self, emulation: &Emulation, works: &[Work]) -> Result<Option<Made>, vk::Result> {
        let (next, kernels) = (&emulation.next, emulation.kernels()?);
        if self.queries.iter().any(|query| query.is_active) {
            tell("a query that has counted other draws within its render pass cannot count Gaussians too");
            return Err(vk::Result::ERROR_FEATURE_NOT_PRESENT);
        }
        let Some(pass) = self.pass.take() else {
            return Ok(None);
        };
        let most_pairs = u64::from(kernels.feedback.word(0));
        let mut made = None;
        // SAFETY: the caller's promise.
        unsafe {
            if let (Some(end), Some(_)) = (next.end_conditional_rendering, self.condition) {
                end(self.commands);
            }
            pass.interrupt(next, self.commands);
            let mut failure = None;
            let attachment = pass.depth_stencil(&emulation.objects().views);
            for work in works {
                let attachment = attachment.as_ref().filter(|_| work.knows_attachment());
                let extent = work.extent(most_pairs);
                let places = Places::of(&extent);
                match emulation.scratch(self.family, &mut self.scratch, places.end) {
                    Ok(scratch) => {
                        match work.record(next, kernels, self.commands, &scratch, &extent, attachment) {
                            Ok(times) => self.times.extend(times),
                            Err(error) => failure = Some(error),
                        }
                        made = Some(work.made_in(&scratch, &places));
                        if !self.kept.iter().any(|kept| Arc::ptr_eq(kept, &scratch)) {
                            self.kept.push(scratch);
                        }
                    }
                    Err(error) => failure = Some(error),
                }
            }
            barrier(next, self.commands);
            pass.resume(next, self.commands);
            if let (Some(begin), Some(condition)) = (next.begin_conditional_rendering, self.condition) {
                let info = vk::ConditionalRenderingBeginInfoEXT::default()
                    .buffer(condition.buffer)
                    .offset(condition.offset)
                    .flags(condition.flags);
                begin(self.commands, &raw const info);
            }
            self.pass = Some(pass);
            self.restore_compute(next);
            for work in works {
                self.restore_after_projecting(next, work);
            }
            failure.map_or(Ok(made), Err)
        }
    }

    /// Restores what dispatches have changed.
    ///
    /// # Safety
    /// See [`Self::activate_queries`].
    unsafe fn restore_compute(&self, next: &Next) {
        let compute = vk::PipelineBindPoint::COMPUTE;
        // SAFETY: the caller's promise: the application has bound these.
        unsafe {
            if self.compute != vk::Pipeline::null() {
                next.cmd_bind_pipeline(self.commands, compute, self.compute);
            }
            let own = self.descriptors.iter().filter(|((point, _), _)| *point == compute.as_raw());
            for ((_, number), bound) in own {
                let sets = [bound.set];
                next.cmd_bind_descriptor_sets(self.commands, compute, bound.layout, *number, &sets, &bound.offsets);
            }
        }
    }

    /// Binds again what the draws with projecting shaders have replaced, but for the pipeline and push constants.
    ///
    /// # Safety
    /// See [`Self::activate_queries`].
    unsafe fn restore_after_projecting(&self, next: &Next, work: &Work) {
        let Some(last) = work.shader_draws.last() else {
            return;
        };
        // SAFETY: the caller's promise: the application has bound these.
        unsafe {
            self.bindings().bind_sets(next, self.commands, &last.bindings.sets);
            for (&binding, buffer) in &self.vertex_buffers {
                buffer.bind(next, self.commands, binding);
            }
            if let Some(index) = &self.index_buffer {
                next.cmd_bind_index_buffer(self.commands, index.buffer, index.offset, index.ty);
            }
        }
    }

    /// Draws what a set has made, and restores what that has changed.
    ///
    /// # Safety
    /// See [`Self::activate_queries`].
    unsafe fn show(&mut self, emulation: &Emulation, work: &Work, made: &Made) -> Result<(), vk::Result> {
        let (next, kernels, commands) = (&emulation.next, emulation.kernels()?, self.commands);
        let ([x, y], [width, height]) = (work.area.origin, work.area.size);
        let area = vk::Rect2D { offset: vk::Offset2D { x, y }, extent: vk::Extent2D { width, height } };
        let viewport = |[width, height]: [u32; 2]| vk::Viewport {
            x: x as f32,
            y: y as f32,
            width: width as f32,
            height: height as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        };
        let mut picture = work.picture(made.address());
        let [across, down] = work.tiles();
        let resolve = work.pipeline.resolve.as_ref();
        let graphics = vk::PipelineBindPoint::GRAPHICS;
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        // SAFETY: the caller's promise: the application has recorded what is repeated.
        unsafe {
            self.activate_queries(next);
            next.cmd_bind_pipeline(commands, graphics, work.pipeline.raw);
            next.cmd_set_viewport(commands, 0, &[viewport(work.shown_size(next))]);
            next.cmd_set_scissor(commands, 0, &[area]);
            if resolve.is_some() {
                self.bind_for_shader(next, work, made);
            }
            for outcome in work.outcomes() {
                if work.pipeline.tests.is_some() {
                    outcome.set(next, commands, &work.tests.unwrap_or_default());
                }
                if let (Some(resolve), Outcome::Passed) = (resolve, outcome) {
                    let draws = if resolve.is_sample_shaded { 1 } else { work.samples() };
                    for sample in 0..draws {
                        next.cmd_draw(commands, work.vertices_of_tile() * across * down, 1, 0, sample);
                    }
                    continue;
                }
                if let Some(resolve) = resolve {
                    next.cmd_bind_pipeline(commands, graphics, resolve.without_shader);
                    next.cmd_set_viewport(commands, 0, &[viewport(work.area.size)]);
                }
                for sample in 0..work.samples() {
                    picture.show(sample, *outcome);
                    next.cmd_push_constants(commands, kernels.fetch_layout, stages, 0, bytemuck::bytes_of(&picture));
                    next.cmd_draw(commands, 6 * across * down, 1, 0, 0);
                }
            }
            for repeat in self.states.values() {
                repeat(next, commands);
            }
            if resolve.is_some() {
                self.restore_after_shader(next, work);
            }
            if let Bound::Other(pipeline) = self.graphics {
                next.cmd_bind_pipeline(commands, graphics, pipeline);
            }
            self.bindings().push_constants(next, commands);
        }
        Ok(())
    }

    /// Binds what a resolve shader reads, as it was at the set's first draw.
    ///
    /// # Safety
    /// See [`Self::activate_queries`].
    unsafe fn bind_for_shader(&self, next: &Next, work: &Work, made: &Made) {
        // SAFETY: the caller's promise: the application has bound and pushed these.
        unsafe {
            next.cmd_bind_vertex_buffers(self.commands, 0, &[made.memory.buffer], &[work.attributes_place(made)]);
            let Some(bindings) = &work.bindings else {
                return;
            };
            bindings.push_constants(next, self.commands);
            bindings.bind_sets(next, self.commands, &self.bindings().sets);
        }
    }

    /// Binds the application's vertex buffer and descriptor sets again.
    ///
    /// # Safety
    /// See [`Self::activate_queries`].
    unsafe fn restore_after_shader(&self, next: &Next, work: &Work) {
        // SAFETY: the caller's promise: the application has bound these.
        unsafe {
            if let Some(before) = self.vertex_buffers.get(&0) {
                before.bind(next, self.commands, 0);
            }
            if let Some(bindings) = &work.bindings {
                self.bindings().bind_sets(next, self.commands, &bindings.sets);
            }
        }
    }

    /// Computes the sets of secondary command buffers that are about to be executed.
    ///
    /// # Safety
    /// See [`Self::activate_queries`].
    pub(crate) unsafe fn before_secondaries(&mut self, emulation: &Emulation, works: &[Work]) {
        if works.is_empty() {
            return;
        }
        // SAFETY: the caller's promise.
        if let Err(error) = unsafe { self.between(emulation, works) } {
            self.failure = Some(error);
        }
    }

    /// The sets that a secondary command buffer shows.
    pub(crate) fn works(&self) -> &[Work] {
        &self.works
    }
}
