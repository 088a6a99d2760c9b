//! Devices: the next layer's commands, what is known, and messages to the application.

use std::collections::{HashMap, HashSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;

use crate::facts::Facts;
use crate::instance::Instance;
use crate::next::Next;
use crate::objects::Objects;
use crate::pending::Submissions;
use crate::recording::Recording;
use crate::report::Faults;
use crate::request::Libraries;
use gaurast_layer_interface::Live;

/// The greatest number of times that one message is given on a device.
const REPEATS: u32 = 32;

/// The state that changes as commands are called.
#[derive(Default)]
pub(crate) struct State {
    pub(crate) objects: Objects,
    pub(crate) recordings: HashMap<vk::CommandBuffer, Recording>,
    /// Draws whose contents were looked at, by what they read: applications record the same draw for each frame.
    pub(crate) checked: HashSet<u64>,
    pub(crate) libraries: Libraries,
    /// Submissions whose end is awaited.
    pub(crate) pending: Submissions,
    /// Principal points of cameras, up to two, by all else that they have: parts of one picture differ in them alone.
    pub(crate) principal_points: HashMap<u64, HashSet<[u32; 2]>>,
}

impl State {
    /// The recording of a command buffer, and the objects.
    pub(crate) fn recording(&mut self, commands: vk::CommandBuffer) -> (&mut Recording, &mut Objects) {
        (self.recordings.entry(commands).or_default(), &mut self.objects)
    }
}

/// A device.
pub(crate) struct Device {
    pub(crate) handle: vk::Device,
    pub(crate) physical_device: vk::PhysicalDevice,
    pub(crate) get_device_proc_addr: vk::PFN_vkGetDeviceProcAddr,
    pub(crate) next: Next,
    pub(crate) instance: Arc<Instance>,
    pub(crate) facts: Facts,
    state: Mutex<State>,
    /// The number of messages of each kind.
    messages: Mutex<HashMap<&'static str, u32>>,
}

/// The devices that live.
static DEVICES: Live<Device> = Live::new();

impl Device {
    /// Makes what the layer knows of a device.
    pub(crate) fn new(
        handle: vk::Device,
        physical_device: vk::PhysicalDevice,
        get_device_proc_addr: vk::PFN_vkGetDeviceProcAddr,
        instance: Arc<Instance>,
        facts: Facts,
    ) -> Self {
        // SAFETY: the next layer gives its own commands by name.
        let next = unsafe { Next::load(|name| get_device_proc_addr(handle, name.as_ptr())) };
        Self {
            handle,
            physical_device,
            get_device_proc_addr,
            next,
            instance,
            facts,
            state: Mutex::default(),
            messages: Mutex::default(),
        }
    }

    /// Remembers a device.
    pub(crate) fn register(self) {
        // SAFETY: the next layer has just made it.
        unsafe { DEVICES.insert(self.handle, self) };
    }

    /// The device of a handle of its own, of a queue or of a command buffer.
    ///
    /// # Safety
    /// The handle is valid.
    pub(crate) unsafe fn of<H: vk::Handle>(handle: H) -> Option<Arc<Self>> {
        // SAFETY: the caller's promise.
        unsafe { DEVICES.of(handle) }
    }

    /// Forgets a device, and gives it a last time.
    ///
    /// # Safety
    /// The handle is valid.
    pub(crate) unsafe fn forget(handle: vk::Device) -> Option<Arc<Self>> {
        // SAFETY: the caller's promise.
        unsafe { DEVICES.remove(handle) }
    }

    /// Locks the state that changes.
    pub(crate) fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Looks at a command, and tells what is wrong with it. A panic goes no further: the command is passed on
    /// unchecked.
    pub(crate) fn observe(&self, look: impl FnOnce(&mut State, &mut Faults)) {
        let mut faults = Faults::default();
        let looked = {
            let mut state = self.lock();
            catch_unwind(AssertUnwindSafe(|| look(&mut state, &mut faults)))
        };
        if looked.is_err() {
            eprintln!("VK_LAYER_GAURAST_validation: a defect of the layer; a command goes unchecked");
        }
        self.tell(&faults);
    }

    /// Tells the application, while nothing is locked.
    pub(crate) fn tell(&self, faults: &Faults) {
        for fault in &faults.0 {
            let times = {
                let mut messages = self.messages.lock().unwrap_or_else(PoisonError::into_inner);
                let times = messages.entry(fault.id).or_default();
                *times += 1;
                *times
            };
            if times > REPEATS {
                continue;
            }
            let mut fault = fault.clone();
            if times == REPEATS {
                fault.text += " (further messages of this kind are left out)";
            }
            self.instance.messengers.tell(&fault);
        }
    }
}
