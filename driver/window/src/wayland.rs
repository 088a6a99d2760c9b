//! Surfaces of Wayland: pictures are buffers of memory that is shared with the compositor (`wl_shm`).
//!
//! The connection is the application's. The driver has an event queue of its own on it, so that each of the two
//! receives only events of its own objects.

use crate::error::lost;
use crate::shared_memory::SharedMemory;
use driver::window::{Canvas, CanvasOptions, NativeWindow, PresentMode, Window, WindowLost, WindowSystem};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::ffi::CStr;
use std::time::{Duration, Instant};
use wayland_backend::client::{Backend, ObjectId};
use wayland_client::globals::{GlobalListContents, registry_queue_init};
use wayland_client::protocol::wl_buffer::{self, WlBuffer};
use wayland_client::protocol::wl_callback::{self, WlCallback};
use wayland_client::protocol::wl_registry::{self, WlRegistry};
use wayland_client::protocol::wl_shm::{Format, WlShm};
use wayland_client::protocol::wl_shm_pool::WlShmPool;
use wayland_client::protocol::wl_surface::WlSurface;
use wayland_client::{Connection, Dispatch, EventQueue, Proxy, QueueHandle, delegate_noop};

/// The longest wait for a compositor to ask for a picture. It asks for none while a window is hidden, and an
/// application that waits for one of its images should then continue, if slowly.
const LONGEST_FRAME: Duration = Duration::from_millis(250);

/// The number of buffers: one that is shown, one that waits, and one that is written.
const BUFFERS: usize = 3;

/// The first version of `wl_surface` in which damage is given in pixels of the buffer.
const DAMAGE_BUFFER_SINCE: u32 = 4;

/// The window system of `VK_KHR_wayland_surface`.
pub(crate) struct Wayland;

impl WindowSystem for Wayland {
    fn extension(&self) -> &'static CStr {
        ash::khr::wayland_surface::NAME
    }

    unsafe fn open(&self, window: NativeWindow) -> Result<Box<dyn Window>, WindowLost> {
        let NativeWindow::Wayland { display, surface } = window else {
            return Err(lost(format_args!("{window:?} is no surface of Wayland's")));
        };
        // SAFETY: the caller's promise.
        let (backend, id) = unsafe {
            let backend = Backend::from_foreign_display(display.as_ptr().cast());
            let id = ObjectId::from_ptr(WlSurface::interface(), surface.as_ptr().cast());
            (backend, id.map_err(lost)?)
        };
        let connection = Connection::from_backend(backend);
        let surface = WlSurface::from_id(&connection, id).map_err(lost)?;
        Ok(Box::new(WaylandWindow { connection, surface }))
    }
}

/// A surface of Wayland.
struct WaylandWindow {
    connection: Connection,
    surface: WlSurface,
}

impl Window for WaylandWindow {
    fn extent(&self) -> Result<Option<[u32; 2]>, WindowLost> {
        match self.connection.backend().last_error() {
            None => Ok(None),
            Some(error) => Err(lost(error)),
        }
    }

    fn present_modes(&self) -> &'static [PresentMode] {
        // A compositor shows no picture before its next refresh.
        &[PresentMode::Fifo, PresentMode::Mailbox]
    }

    fn has_alpha(&self) -> bool {
        true
    }

    fn canvas(&self, options: CanvasOptions) -> Result<Box<dyn Canvas>, WindowLost> {
        let [width, height] = options.extent;
        let size = 4 * width as usize * height as usize;
        let (Ok(width), Ok(height)) = (i32::try_from(width), i32::try_from(height)) else {
            return Err(lost(format_args!("{width}x{height} is too large")));
        };
        let Ok(pool_size) = i32::try_from(BUFFERS * size) else {
            return Err(lost(format_args!("{width}x{height} is too large")));
        };
        let (globals, queue) = registry_queue_init::<Events>(&self.connection).map_err(lost)?;
        let handle = queue.handle();
        let shm: WlShm = globals.bind(&handle, 1..=1, ()).map_err(lost)?;
        let memory = SharedMemory::new(pool_size as usize)?;
        let pool = shm.create_pool(memory.descriptor(), pool_size, &handle, ());
        let format = if options.has_alpha { Format::Argb8888 } else { Format::Xrgb8888 };
        let buffers = std::array::from_fn(|index| {
            let offset = (index * size) as i32;
            pool.create_buffer(offset, width, height, 4 * width, format, &handle, index)
        });
        pool.destroy();
        Ok(Box::new(WaylandCanvas {
            connection: self.connection.clone(),
            surface: self.surface.clone(),
            size,
            extent: [width, height],
            memory,
            buffers,
            queue,
            events: Events::default(),
            shown: Instant::now(),
        }))
    }
}

/// The state reported by the compositor's events.
#[derive(Default)]
struct Events {
    /// True if the compositor has not yet asked for the next picture.
    is_waiting: bool,
    /// True for buffers that the compositor is reading.
    is_busy: [bool; BUFFERS],
}

impl Dispatch<WlRegistry, GlobalListContents> for Events {
    fn event(
        _: &mut Self,
        _: &WlRegistry,
        _: wl_registry::Event,
        _: &GlobalListContents,
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
    }
}

impl Dispatch<WlBuffer, usize> for Events {
    fn event(
        events: &mut Self,
        _: &WlBuffer,
        event: wl_buffer::Event,
        &index: &usize,
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        if let wl_buffer::Event::Release = event {
            events.is_busy[index] = false;
        }
    }
}

impl Dispatch<WlCallback, ()> for Events {
    fn event(
        events: &mut Self,
        _: &WlCallback,
        event: wl_callback::Event,
        (): &(),
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        if let wl_callback::Event::Done { .. } = event {
            events.is_waiting = false;
        }
    }
}

delegate_noop!(Events: ignore WlShm);
delegate_noop!(Events: WlShmPool);

/// A surface's buffers.
struct WaylandCanvas {
    connection: Connection,
    surface: WlSurface,
    /// The size of a picture in bytes.
    size: usize,
    /// Width and height of pictures.
    extent: [i32; 2],
    memory: SharedMemory,
    buffers: [WlBuffer; BUFFERS],
    queue: EventQueue<Events>,
    events: Events,
    /// The time at which the last picture was shown.
    shown: Instant,
}

impl WaylandCanvas {
    /// Dispatches events until `is_over`, at most for `longest`. Returns true if it is.
    fn listen(&mut self, longest: Duration, is_over: impl Fn(&Events) -> bool) -> Result<bool, WindowLost> {
        let end = Instant::now() + longest;
        loop {
            self.queue.dispatch_pending(&mut self.events).map_err(lost)?;
            if is_over(&self.events) {
                return Ok(true);
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(false);
            }
            self.queue.flush().map_err(lost)?;
            // If there is no guard, some events are not dispatched yet.
            let Some(guard) = self.queue.prepare_read() else {
                continue;
            };
            let left = Timespec::try_from(left).map_err(lost)?;
            let mut sockets = [PollFd::from_borrowed_fd(guard.connection_fd(), PollFlags::IN)];
            match poll(&mut sockets, Some(&left)) {
                Ok(0) | Err(rustix::io::Errno::INTR) => {}
                Ok(_) => {
                    guard.read().map_err(lost)?;
                }
                Err(error) => return Err(lost(error)),
            }
        }
    }
}

impl Canvas for WaylandCanvas {
    fn wait(&mut self, longest: Duration) -> Result<bool, WindowLost> {
        let is_asked = self.listen(longest, |events| !events.is_waiting)?;
        Ok(is_asked || self.shown.elapsed() > LONGEST_FRAME)
    }

    fn show(&mut self, copy: &mut dyn FnMut(&mut [u8])) -> Result<(), WindowLost> {
        let is_free = |events: &Events| events.is_busy.contains(&false);
        self.listen(LONGEST_FRAME, is_free)?;
        self.shown = Instant::now();
        // If the compositor is reading all buffers, this picture is skipped.
        let Some(index) = self.events.is_busy.iter().position(|&is_busy| !is_busy) else {
            return Ok(());
        };
        copy(&mut self.memory.bytes()[index * self.size..][..self.size]);
        self.events.is_busy[index] = true;
        let [width, height] = self.extent;
        self.surface.attach(Some(&self.buffers[index]), 0, 0);
        if self.surface.version() >= DAMAGE_BUFFER_SINCE {
            self.surface.damage_buffer(0, 0, width, height);
        } else {
            self.surface.damage(0, 0, i32::MAX, i32::MAX);
        }
        if !self.events.is_waiting {
            self.surface.frame(&self.queue.handle(), ());
            self.events.is_waiting = true;
        }
        self.surface.commit();
        self.connection.flush().or_else(|error| match error {
            // The socket is full: the rest is sent by the next flush.
            wayland_backend::client::WaylandError::Io(error) if error.kind() == std::io::ErrorKind::WouldBlock => {
                Ok(())
            }
            error => Err(lost(error)),
        })
    }
}

impl Drop for WaylandCanvas {
    fn drop(&mut self) {
        for buffer in &self.buffers {
            buffer.destroy();
        }
        // It doesn't matter if the compositor is gone.
        let _ = self.connection.flush();
    }
}
