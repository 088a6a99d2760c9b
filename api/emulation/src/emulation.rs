//! The emulation of a device that gets the extension: its objects, kernels and scratch.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

use ash::vk;

use crate::attachments::{Image, View};
use crate::kernels::Kernels;
use crate::library::Library;
use crate::next::Next;
use crate::pipeline::Pipeline;
use crate::render_pass::RenderPass;
use crate::scratch::Memory;

/// A command pool.
#[derive(Default)]
pub(crate) struct Pool {
    pub(crate) family: u32,
    pub(crate) buffers: Vec<vk::CommandBuffer>,
}

/// Objects of a device.
#[derive(Default)]
pub(crate) struct Objects {
    /// Sizes.
    pub(crate) buffers: HashMap<vk::Buffer, u64>,
    /// Images of depths or stencils, and their views.
    pub(crate) images: HashMap<vk::Image, Image>,
    pub(crate) views: HashMap<vk::ImageView, Arc<View>>,
    /// Attachments.
    pub(crate) framebuffers: HashMap<vk::Framebuffer, Vec<vk::ImageView>>,
    pub(crate) pools: HashMap<vk::CommandPool, Pool>,
    pub(crate) render_passes: HashMap<vk::RenderPass, Arc<RenderPass>>,
    pub(crate) pipelines: HashMap<vk::Pipeline, Arc<Pipeline>>,
    pub(crate) libraries: HashMap<vk::Pipeline, Arc<Library>>,
    /// The words of vertex and fragment shaders.
    pub(crate) shaders: HashMap<vk::ShaderModule, Arc<[u32]>>,
    /// The number of dynamic descriptors of each layout.
    pub(crate) set_layouts: HashMap<vk::DescriptorSetLayout, usize>,
    pub(crate) layouts: HashMap<vk::PipelineLayout, Vec<vk::DescriptorSetLayout>>,
}

/// The emulation of the extension on a device.
pub(crate) struct Emulation {
    pub(crate) next: Arc<Next>,
    /// The number of queues of each family.
    pub(crate) queues: HashMap<u32, u32>,
    kernels: OnceLock<Result<Kernels, vk::Result>>,
    objects: RwLock<Objects>,
    /// Scratch of families with one queue, on which sets follow one another.
    scratch: Mutex<HashMap<u32, Arc<Memory>>>,
}

impl Emulation {
    pub(crate) fn new(next: &Arc<Next>, queues: HashMap<u32, u32>) -> Self {
        Self {
            next: Arc::clone(next),
            queues,
            kernels: OnceLock::new(),
            objects: RwLock::default(),
            scratch: Mutex::default(),
        }
    }

    /// The kernels, which are compiled when a pipeline first needs them.
    pub(crate) fn kernels(&self) -> Result<&Kernels, vk::Result> {
        self.kernels.get_or_init(|| Kernels::new(&self.next)).as_ref().map_err(|&error| error)
    }

    pub(crate) fn objects(&self) -> RwLockReadGuard<'_, Objects> {
        self.objects.read().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn objects_mut(&self) -> RwLockWriteGuard<'_, Objects> {
        self.objects.write().unwrap_or_else(PoisonError::into_inner)
    }

    /// Scratch of at least a size for command buffers of a family. Those of a family with several queues have their own, since
    /// they may be executed at the same time.
    pub(crate) fn scratch(
        &self,
        family: u32,
        own: &mut Option<Arc<Memory>>,
        size: u64,
    ) -> Result<Arc<Memory>, vk::Result> {
        if let Some(memory) = own.as_ref().filter(|memory| memory.size >= size) {
            return Ok(Arc::clone(memory));
        }
        let is_shared = self.queues.get(&family) == Some(&1);
        let mut shared: MutexGuard<'_, _> = self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        let found = shared.get(&family).filter(|memory| is_shared && memory.size >= size).cloned();
        let memory = match found {
            Some(memory) => memory,
            None => {
                // A little more, so that a scene that grows does not allocate at each frame.
                let memory = Arc::new(Memory::new(&self.next, size + size / 4, false)?);
                if is_shared {
                    shared.insert(family, Arc::clone(&memory));
                }
                memory
            }
        };
        *own = Some(Arc::clone(&memory));
        Ok(memory)
    }

    /// Drops all that uses the device.
    pub(crate) fn clear(&self) {
        self.scratch.lock().unwrap_or_else(PoisonError::into_inner).clear();
        *self.objects_mut() = Objects::default();
    }
}
