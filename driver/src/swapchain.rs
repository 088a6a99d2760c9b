//! Swapchains: images that are acquired, drawn to and presented.
//!
//! A presented image waits in a list. When the display is ready, a thread of the swapchain takes it from there and
//! copies it to the window; then the image can be acquired again. So no queue waits for a display.

use crate::abi::error::Error;
use crate::abi::guard::panic_message;
use crate::abi::handle::{self, objects};
use crate::abi::sanitizer::ignore_thread;
use crate::abi::valid;
use crate::command::submit::{Batch, enqueue, with_values};
use crate::device::Device;
use crate::device_sync::{DeviceSync, WaitResult, deadline};
use crate::queue::Queue;
use crate::resource::image::{Image, bind_image_memory, check_instances, new_image};
use crate::resource::memory::{Memory, bind_all};
use crate::surface::Surface;
use crate::sync::{Fence, Semaphore};
use crate::window::{Canvas, PresentMode, WindowLost};
use ash::vk;
use simdevice::format::Aspect;
use std::collections::VecDeque;
use std::mem::MaybeUninit;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// The time that a swapchain's thread waits for the display before it checks whether it should end.
const PATIENCE: Duration = Duration::from_millis(50);

/// A swapchain.
pub(crate) struct Swapchain {
    surface: Arc<Surface>,
    extent: vk::Extent2D,
    images: Vec<PresentableImage>,
    shared: Arc<Shared>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

objects! { vk::SwapchainKHR => Swapchain; }

/// An image of a swapchain, with its handle and its memory.
struct PresentableImage {
    handle: vk::Image,
    memory: Memory,
}

impl Drop for PresentableImage {
    fn drop(&mut self) {
        // SAFETY: the handle was made with the image, and the application may not use it once the swapchain is
        // destroyed.
        if let Err(error) = unsafe { handle::destroy(self.handle) } {
            log::error!("the handle of a swapchain's image was overwritten: {error}");
        }
    }
}

/// The data that a swapchain shares with its thread and with submissions.
struct Shared {
    sync: Arc<DeviceSync>,
    present_mode: PresentMode,
    images: Vec<Arc<Image>>,
    state: Mutex<State>,
    /// Signaled when an image was presented, or the thread should end.
    changed: Condvar,
    /// The reason that nothing can be presented any more.
    lost: OnceLock<WindowLost>,
}

#[derive(Default)]
struct State {
    /// Images that can be acquired, in the order in which they became free.
    free: VecDeque<u32>,
    /// Images that are acquired, and not yet presented.
    acquired: Vec<u32>,
    /// Images that wait to be shown.
    waiting: VecDeque<u32>,
    /// True if another swapchain has replaced this one, or it is being destroyed.
    is_retired: bool,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        // Lists of numbers are consistent after any panic.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes images available to be acquired.
    fn release(&self, images: impl IntoIterator<Item = u32>) {
        self.sync.update(|| self.state().free.extend(images));
    }

    /// Appends an image to the list of those that wait to be shown.
    fn present(&self, index: u32) {
        let mut state = self.state();
        let dropped = if state.is_retired || self.lost.get().is_some() {
            vec![index]
        } else if self.present_mode == PresentMode::Mailbox {
            let older = state.waiting.drain(..).collect();
            state.waiting.push_back(index);
            older
        } else {
            state.waiting.push_back(index);
            Vec::new()
        };
        drop(state);
        self.changed.notify_all();
        if !dropped.is_empty() {
            self.release(dropped);
        }
    }

    /// Waits until there is an image to show. Returns `false` if there won't be one.
    fn wait_for_picture(&self) -> bool {
        let is_idle = |state: &mut State| state.waiting.is_empty() && !state.is_retired;
        let state = self.changed.wait_while(self.state(), is_idle);
        !state.unwrap_or_else(PoisonError::into_inner).is_retired
    }

    /// Shows presented images until the swapchain is retired.
    fn run(&self, canvas: &mut dyn Canvas) -> Result<(), WindowLost> {
        while self.wait_for_picture() {
            if self.present_mode != PresentMode::Immediate {
                while !canvas.wait(PATIENCE)? {
                    if self.state().is_retired {
                        return Ok(());
                    }
                }
            }
            // A newer image may have replaced it meanwhile.
            let Some(index) = self.state().waiting.pop_front() else {
                continue;
            };
            canvas.show(&mut |pixels| self.copy(index, pixels))?;
            self.release([index]);
        }
        Ok(())
    }

    /// Copies an image's pixels to rows without gaps.
    fn copy(&self, index: u32, pixels: &mut [u8]) {
        let image = &self.images[index as usize];
        let Ok(image) = image.bound("VUID-VkPresentInfoKHR-pImageIndices-01430") else {
            return;
        };
        let Some(layout) = image.subresource(Aspect::Color, 0, 0) else {
            return;
        };
        let row_size = 4 * image.desc.extent[0] as usize;
        for (y, row) in (0..).zip(pixels.chunks_exact_mut(row_size)) {
            image.read_row(&layout, [0, y, 0], row);
        }
    }

    /// Ends the thread after its current image, and drops the waiting ones.
    fn retire(&self) {
        let mut state = self.state();
        state.is_retired = true;
        let waiting = std::mem::take(&mut state.waiting);
        drop(state);
        self.changed.notify_all();
        self.release(waiting);
    }

    /// Marks the window as lost and wakes threads that wait for an image.
    fn lose(&self, reason: WindowLost) {
        log::warn!("{reason}");
        self.sync.update(|| {
            self.lost.get_or_init(|| reason);
        });
        let waiting = std::mem::take(&mut self.state().waiting);
        self.release(waiting);
    }
}

impl Swapchain {
    /// Fails if nothing can be presented any more.
    fn check(&self) -> Result<(), Error> {
        match self.shared.lost.get() {
            Some(lost) => Err(Error::SurfaceLost(lost.clone())),
            None => Ok(()),
        }
    }

    /// The status of its images: `VK_SUCCESS`, `VK_SUBOPTIMAL_KHR` if the window has another size, or
    /// `VK_ERROR_OUT_OF_DATE_KHR` if another swapchain has replaced this one.
    ///
    /// # Errors
    /// [`Error::SurfaceLost`].
    fn status(&self) -> Result<vk::Result, Error> {
        if self.shared.state().is_retired {
            return Ok(vk::Result::ERROR_OUT_OF_DATE_KHR);
        }
        self.check()?;
        let vk::Extent2D { width, height } = self.extent;
        Ok(match self.surface.extent()? {
            Some(extent) if extent != [width, height] => vk::Result::SUBOPTIMAL_KHR,
            _ => vk::Result::SUCCESS,
        })
    }

    /// Stops presenting.
    fn retire(&self) {
        self.shared.retire();
        let thread = self.thread.lock();
        let thread = thread.unwrap_or_else(PoisonError::into_inner).take();
        if let Some(thread) = thread {
            if thread.join().is_err() {
                log::error!("a swapchain's thread panicked");
            }
            self.surface.give_back();
        }
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        self.retire();
    }
}

fn check_info(info: &vk::SwapchainCreateInfoKHR<'_>) -> Result<(), Error> {
    let supported = vk::SwapchainCreateFlagsKHR::MUTABLE_FORMAT;
    if !supported.contains(info.flags) {
        let what = format!("a swapchain with {:?}", info.flags);
        return Err(Error::FeatureNotPresent(what));
    }
    if info.image_extent.width == 0 || info.image_extent.height == 0 {
        return Err(Error::usage("VUID-VkSwapchainCreateInfoKHR-imageExtent-01689", "imageExtent is empty"));
    }
    if info.image_array_layers != 1 {
        return Err(Error::usage(
            "VUID-VkSwapchainCreateInfoKHR-imageArrayLayers-01275",
            format!("imageArrayLayers is {}, not 1", info.image_array_layers),
        ));
    }
    Ok(())
}

fn new_presentable_image(
    device: &Device,
    info: &vk::ImageCreateInfo<'_>,
) -> Result<(PresentableImage, Arc<Image>), Error> {
    let image = Arc::new(new_image(info, None, None)?);
    let Some((heap, host_visible)) = device.memory_type(0) else {
        return Err(Error::OutOfDeviceMemory("there is no memory type".into()));
    };
    let memory = Memory::new(heap, image.size(), host_visible)?;
    bind_image_memory(&image, &memory, 0)?;
    let handle = handle::create(Arc::clone(&image));
    Ok((PresentableImage { handle, memory }, image))
}

#[doc(alias = "vkCreateSwapchainKHR")]
pub(crate) fn create_swapchain(
    device: &Device,
    create_info: &vk::SwapchainCreateInfoKHR<'_>,
    surface: &Arc<Surface>,
    old_swapchain: Option<&Swapchain>,
) -> Result<Arc<Swapchain>, Error> {
    let info = create_info;
    // It is retired even if a later step fails.
    if let Some(old) = old_swapchain {
        old.retire();
    }
    check_info(info)?;
    let mut flags = vk::ImageCreateFlags::empty();
    if info.flags.contains(vk::SwapchainCreateFlagsKHR::MUTABLE_FORMAT) {
        flags |= vk::ImageCreateFlags::MUTABLE_FORMAT | vk::ImageCreateFlags::EXTENDED_USAGE;
    }
    let image_info = vk::ImageCreateInfo {
        flags,
        image_type: vk::ImageType::TYPE_2D,
        format: info.image_format,
        extent: info.image_extent.into(),
        mip_levels: 1,
        array_layers: 1,
        samples: vk::SampleCountFlags::TYPE_1,
        usage: info.image_usage,
        ..Default::default()
    };
    let count = info.min_image_count.max(1);
    let (mut images, mut on_device) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let (image, device_image) = new_presentable_image(device, &image_info)?;
        images.push(image);
        on_device.push(device_image);
    }
    let (mut canvas, present_mode) = surface.canvas(info.image_extent, info.present_mode, info.composite_alpha)?;
    let shared = Arc::new(Shared {
        sync: Arc::clone(device.sync()),
        present_mode,
        images: on_device,
        state: Mutex::new(State { free: (0..count).collect(), ..State::default() }),
        changed: Condvar::new(),
        lost: OnceLock::new(),
    });
    surface.take()?;
    let run = Arc::clone(&shared);
    let thread = std::thread::Builder::new()
        .name("gaurast-present".to_owned())
        .spawn(move || {
            ignore_thread();
            let shown = catch_unwind(AssertUnwindSafe(|| run.run(canvas.as_mut())));
            match shown {
                Ok(Ok(())) => {}
                Ok(Err(lost)) => run.lose(lost),
                Err(panic) => run.lose(WindowLost(panic_message(panic.as_ref()).to_owned())),
            }
        })
        .map_err(|error| {
            surface.give_back();
            Error::InitializationFailed(format!("the swapchain's thread cannot start: {error}"))
        })?;
    Ok(Arc::new(Swapchain {
        surface: Arc::clone(surface),
        extent: info.image_extent,
        images,
        shared,
        thread: Mutex::new(Some(thread)),
    }))
}

#[doc(alias = "vkGetSwapchainImagesKHR")]
pub(crate) fn get_swapchain_images(swapchain: &Swapchain) -> Result<Vec<vk::Image>, Error> {
    Ok(swapchain.images.iter().map(|image| image.handle).collect())
}

#[doc(alias = "vkAcquireNextImageKHR")]
#[doc(alias = "vkAcquireNextImage2KHR")]
pub(crate) fn acquire_next_image(
    swapchain: &Swapchain,
    timeout: u64,
    semaphore: Option<&Semaphore>,
    fence: Option<&Fence>,
    image_index: &mut u32,
) -> Result<vk::Result, Error> {
    let shared = &swapchain.shared;
    let status = swapchain.status()?;
    if status == vk::Result::ERROR_OUT_OF_DATE_KHR {
        return Ok(status);
    }
    let waited = shared.sync.wait(deadline(timeout), || shared.lost.get().is_some() || !shared.state().free.is_empty());
    match waited {
        WaitResult::Ready => swapchain.check()?,
        WaitResult::TimedOut if timeout == 0 => return Ok(vk::Result::NOT_READY),
        WaitResult::TimedOut => return Ok(vk::Result::TIMEOUT),
        WaitResult::Lost => {
            shared.sync.check()?;
            return Ok(vk::Result::ERROR_DEVICE_LOST);
        }
    }
    let mut state = shared.state();
    // Only one thread at a time may acquire images of a swapchain.
    let Some(index) = state.free.pop_front() else {
        return Ok(vk::Result::NOT_READY);
    };
    state.acquired.push(index);
    drop(state);
    *image_index = index;
    // The image has been copied to the window before it became free.
    if let Some(semaphore) = semaphore {
        semaphore.signal(0);
    }
    if let Some(fence) = fence {
        fence.signal();
    }
    Ok(status)
}

/// Presents one swapchain's image. Returns the result for the application.
fn present_one(queue: &Queue, swapchain: &Swapchain, index: u32) -> Result<vk::Result, Error> {
    let shared = &swapchain.shared;
    let mut state = shared.state();
    let place = state.acquired.iter().position(|&acquired| acquired == index);
    let Some(place) = place else {
        return Err(Error::usage(
            "VUID-VkPresentInfoKHR-pImageIndices-01430",
            format!("image {index} is presented without having been acquired"),
        ));
    };
    state.acquired.swap_remove(place);
    drop(state);
    let status = swapchain.status();
    // It becomes free again even if it can't be shown.
    let shared = Arc::clone(shared);
    queue.submit(Box::new(move |_| shared.present(index)))?;
    status
}

/// # Safety
/// The info, its chain and its handles are valid, and its results are null or have enough elements.
#[doc(alias = "vkQueuePresentKHR")]
pub(crate) unsafe fn queue_present(queue: &Queue, present_info: &vk::PresentInfoKHR<'_>) -> Result<vk::Result, Error> {
    let info = present_info;
    // SAFETY: the caller's promise.
    let (waits, swapchains, indices) = unsafe {
        let waits = valid::slice(info.p_wait_semaphores, info.wait_semaphore_count)?;
        let swapchains = valid::slice(info.p_swapchains, info.swapchain_count)?;
        (
            handle::get_all(waits)?,
            handle::get_all(swapchains)?,
            valid::slice(info.p_image_indices, info.swapchain_count)?,
        )
    };
    let results: &mut [MaybeUninit<vk::Result>] = if info.p_results.is_null() {
        &mut []
    } else {
        // SAFETY: the caller's promise.
        unsafe { valid::output_slice(info.p_results, swapchains.len())? }
    };
    let batch = Batch { waits: with_values(waits, &[]), commands: Vec::new(), signals: Vec::new() };
    enqueue(queue, vec![batch], None)?;
    let mut results = results.iter_mut();
    let mut whole = Ok(vk::Result::SUCCESS);
    for (swapchain, &index) in swapchains.iter().zip(indices) {
        let result = present_one(queue, swapchain, index);
        if let Some(out) = results.next() {
            out.write(result.as_ref().map_or_else(Error::result, |&code| code));
        }
        // The worst result: errors are worse than suboptimal, and that is worse than success.
        let is_worse = |code: &vk::Result| *code != vk::Result::SUCCESS;
        whole = match (whole, result) {
            (Err(error), _) | (_, Err(error)) => Err(error),
            (Ok(before), Ok(_)) if before.as_raw() < 0 => Ok(before),
            (Ok(before), Ok(code)) => Ok(if is_worse(&code) { code } else { before }),
        };
    }
    whole
}

/// Binds images to memory, or to the memory of a swapchain's image.
///
/// # Safety
/// The infos, their chains and their handles are valid.
#[doc(alias = "vkBindImageMemory2")]
pub(crate) unsafe fn bind_image_memory2(bind_infos: &[vk::BindImageMemoryInfo<'_>]) -> Result<(), Error> {
    let bind = |info: &vk::BindImageMemoryInfo<'_>| {
        // SAFETY: the caller's promise.
        let (image, of_swapchain, plane) = unsafe {
            let of_swapchain = valid::find_in_chain::<vk::BindImageMemorySwapchainInfoKHR<'_>>(info.p_next);
            let plane = valid::find_in_chain::<vk::BindImagePlaneMemoryInfo<'_>>(info.p_next);
            (handle::get(info.image)?, of_swapchain, plane)
        };
        // SAFETY: the caller's promise.
        unsafe {
            if let Some(group) = valid::find_in_chain::<vk::BindImageMemoryDeviceGroupInfo<'_>>(info.p_next) {
                let devices = valid::slice(group.p_device_indices, group.device_index_count)?;
                let count = group.split_instance_bind_region_count;
                check_instances(image, devices, valid::slice(group.p_split_instance_bind_regions, count)?)?;
            }
        }
        if let Some(info) = of_swapchain {
            // SAFETY: the caller's promise.
            let swapchain = unsafe { handle::get_optional(info.swapchain)? };
            if let Some(swapchain) = swapchain {
                let presentable = swapchain.images.get(info.image_index as usize);
                let presentable = presentable.ok_or_else(|| {
                    Error::usage(
                        "VUID-VkBindImageMemorySwapchainInfoKHR-imageIndex-01644",
                        format!("the swapchain has no image {}", info.image_index),
                    )
                })?;
                return bind_image_memory(image, &presentable.memory, 0);
            }
        }
        // SAFETY: the caller's promise.
        let memory = unsafe { handle::get(info.memory)? };
        image.bind(memory.allocation(), info.memory_offset, plane.map(|info| info.plane_aspect))
    };
    // SAFETY: the caller's promise.
    unsafe { bind_all(bind_infos, |info| info.p_next, bind) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{Receiver, Sender, channel};

    /// A display whose refreshes the test triggers, and which is lost when the test drops its sender.
    struct Display(Receiver<()>);

    impl Canvas for Display {
        fn wait(&mut self, longest: Duration) -> Result<bool, WindowLost> {
            use std::sync::mpsc::RecvTimeoutError as E;
            match self.0.recv_timeout(longest) {
                Ok(()) => Ok(true),
                Err(E::Timeout) => Ok(false),
                Err(E::Disconnected) => Err(WindowLost("in a test".to_owned())),
            }
        }

        fn show(&mut self, _copy: &mut dyn FnMut(&mut [u8])) -> Result<(), WindowLost> {
            Ok(())
        }
    }

    /// Starts a thread that presents three images. Returns it with the shared data and the sender of refreshes.
    fn start(present_mode: PresentMode) -> (Arc<Shared>, Sender<()>, JoinHandle<()>) {
        let shared = Arc::new(Shared {
            sync: Arc::default(),
            present_mode,
            images: Vec::new(),
            state: Mutex::default(),
            changed: Condvar::new(),
            lost: OnceLock::new(),
        });
        let (refresh, display) = channel();
        let run = Arc::clone(&shared);
        let thread = std::thread::spawn(move || {
            if let Err(lost) = run.run(&mut Display(display)) {
                run.lose(lost);
            }
        });
        (shared, refresh, thread)
    }

    /// Waits until `count` images are free. Returns them.
    fn free(shared: &Shared, count: usize) -> Vec<u32> {
        let is_free = || shared.state().free.len() >= count;
        let waited = shared.sync.wait(deadline(20_000_000_000), is_free);
        assert_eq!(waited, WaitResult::Ready);
        shared.state().free.iter().copied().collect()
    }

    #[test]
    fn pictures_are_shown_in_order_one_at_a_refresh() {
        let (shared, refresh, thread) = start(PresentMode::Fifo);
        for image in [2, 0, 1] {
            shared.present(image);
        }
        refresh.send(()).unwrap();
        assert_eq!(free(&shared, 1), [2]);
        refresh.send(()).unwrap();
        refresh.send(()).unwrap();
        assert_eq!(free(&shared, 3), [2, 0, 1]);
        shared.retire();
        thread.join().unwrap();
    }

    #[test]
    fn the_newest_picture_takes_the_place_of_those_before_it() {
        let (shared, refresh, thread) = start(PresentMode::Mailbox);
        for image in [0, 1, 2] {
            shared.present(image);
        }
        assert_eq!(free(&shared, 2), [0, 1]);
        refresh.send(()).unwrap();
        assert_eq!(free(&shared, 3), [0, 1, 2]);
        shared.retire();
        thread.join().unwrap();
    }

    #[test]
    fn what_waits_is_given_up_when_there_is_no_window_or_another_swapchain() {
        for retires in [false, true] {
            let (shared, refresh, thread) = start(PresentMode::Fifo);
            shared.present(0);
            shared.present(1);
            if retires {
                shared.retire();
            } else {
                drop(refresh);
            }
            let mut given_up = free(&shared, 2);
            given_up.sort_unstable();
            assert_eq!(given_up, [0, 1]);
            thread.join().unwrap();
            assert_eq!(shared.lost.get().is_some(), !retires);
            // A later image is dropped at once.
            shared.present(2);
            assert_eq!(free(&shared, 3).last(), Some(&2));
        }
    }
}
