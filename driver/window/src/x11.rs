//! Windows of X11: pictures are put to them through memory that is shared with the server (MIT-SHM), or through the
//! connection if the server shares none, as over a network.
//!
//! The connection is the application's: requests are sent on any thread, as libxcb allows, and none of them leaves an
//! event or an error in the application's queue. So the driver can't receive the display's refreshes. It reads their
//! period from RandR, and paces pictures with a clock.

use crate::error::lost;
use crate::shared_memory::SharedMemory;
use driver::window::{Canvas, CanvasOptions, NativeWindow, PresentMode, Window, WindowLost, WindowSystem};
use libloading::Library;
use std::ffi::{CStr, c_int, c_void};
use std::os::fd::{AsRawFd, BorrowedFd};
use std::ptr::NonNull;
use std::sync::Arc;
use std::time::{Duration, Instant};
use x11rb::connection::{Connection, RequestConnection};
use x11rb::protocol::randr::{self, ConnectionExt as _, ModeFlag};
use x11rb::protocol::shm::{self, ConnectionExt as _};
use x11rb::protocol::xproto::{ConnectionExt as _, CreateGCAux, ImageFormat, ImageOrder};
use x11rb::xcb_ffi::XCBConnection;

/// The period assumed for a display that reports none: 60 Hz.
const USUAL_PERIOD: Duration = Duration::from_nanos(16_666_667);

/// The window system of `VK_KHR_xcb_surface`.
pub(crate) struct Xcb;

impl WindowSystem for Xcb {
    fn extension(&self) -> &'static CStr {
        ash::khr::xcb_surface::NAME
    }

    unsafe fn open(&self, window: NativeWindow) -> Result<Box<dyn Window>, WindowLost> {
        match window {
            // SAFETY: the caller's promise.
            NativeWindow::Xcb { connection, window } => unsafe { Ok(Box::new(X11Window::open(connection, window)?)) },
            other => Err(lost(format_args!("{other:?} is no window of libxcb's"))),
        }
    }
}

/// The window system of `VK_KHR_xlib_surface`.
pub(crate) struct Xlib;

impl WindowSystem for Xlib {
    fn extension(&self) -> &'static CStr {
        ash::khr::xlib_surface::NAME
    }

    unsafe fn open(&self, window: NativeWindow) -> Result<Box<dyn Window>, WindowLost> {
        match window {
            // SAFETY: the caller's promise; the connection lives as long as its display.
            NativeWindow::Xlib { display, window } => unsafe {
                Ok(Box::new(X11Window::open(connection_of_display(display)?, window)?))
            },
            other => Err(lost(format_args!("{other:?} is no window of Xlib's"))),
        }
    }
}

/// The libxcb connection of an Xlib display.
///
/// # Safety
/// The pointer is an open `Display`.
unsafe fn connection_of_display(display: NonNull<c_void>) -> Result<NonNull<c_void>, WindowLost> {
    type GetConnection = unsafe extern "C" fn(*mut c_void) -> *mut c_void;
    // SAFETY: the library is a part of Xlib, and starts nothing when it is loaded; the function has that type in its
    // header.
    let connection = unsafe {
        let library = Library::new("libX11-xcb.so.1").map_err(lost)?;
        let get = library.get::<GetConnection>(b"XGetXCBConnection\0").map_err(lost)?;
        get(display.as_ptr())
    };
    NonNull::new(connection).ok_or_else(|| lost("the display has no connection"))
}

/// Fails if a connection is already broken.
///
/// # Safety
/// The pointer is an `xcb_connection_t`.
unsafe fn check_connection(connection: NonNull<c_void>) -> Result<(), WindowLost> {
    type HasError = unsafe extern "C" fn(*mut c_void) -> c_int;
    // SAFETY: the application has loaded the library, or there would be no connection; the function has that type in
    // its header.
    let error = unsafe {
        let library = Library::new("libxcb.so.1").map_err(lost)?;
        let has_error = library.get::<HasError>(b"xcb_connection_has_error\0").map_err(lost)?;
        has_error(connection.as_ptr())
    };
    match error {
        0 => Ok(()),
        error => Err(lost(format_args!("the connection to the X server is broken ({error})"))),
    }
}

/// A window of X11.
struct X11Window {
    connection: Arc<XCBConnection>,
    window: u32,
    depth: u8,
    /// The time between refreshes of the display.
    period: Duration,
}

impl X11Window {
    /// # Safety
    /// The connection is an `xcb_connection_t` and stays open until the window, and everything made of it, are dropped.
    unsafe fn open(connection: NonNull<c_void>, window: u32) -> Result<Self, WindowLost> {
        // SAFETY: the caller's promise.
        let connection = unsafe {
            check_connection(connection)?;
            XCBConnection::from_raw_xcb_connection(connection.as_ptr(), false).map_err(lost)?
        };
        let geometry = connection.get_geometry(window).map_err(lost)?;
        let geometry = geometry.reply().map_err(lost)?;
        let setup = connection.setup();
        let is_supported = setup.image_byte_order == ImageOrder::LSB_FIRST
            && matches!(geometry.depth, 24 | 32)
            && setup.pixmap_formats.iter().any(|format| format.depth == geometry.depth && format.bits_per_pixel == 32);
        if !is_supported {
            return Err(lost(format_args!("pixels of depth {} are not put to windows", geometry.depth)));
        }
        Ok(Self {
            window,
            depth: geometry.depth,
            period: refresh_period(&connection, geometry.root).unwrap_or(USUAL_PERIOD),
            connection: Arc::new(connection),
        })
    }
}

/// The period of the fastest display of a screen; `None` if the server knows none.
fn refresh_period(connection: &XCBConnection, root: u32) -> Option<Duration> {
    connection.extension_information(randr::X11_EXTENSION_NAME).ok()??;
    let resources = connection.randr_get_screen_resources_current(root).ok()?;
    let resources = resources.reply().ok()?;
    let seconds = resources
        .crtcs
        .iter()
        .filter_map(|&crtc| {
            let crtc = connection.randr_get_crtc_info(crtc, resources.config_timestamp).ok()?;
            let mode = crtc.reply().ok()?.mode;
            let mode = resources.modes.iter().find(|known| known.id == mode)?;
            let mut lines = f64::from(mode.vtotal);
            if mode.mode_flags.contains(ModeFlag::INTERLACE) {
                lines /= 2.0;
            }
            if mode.mode_flags.contains(ModeFlag::DOUBLE_SCAN) {
                lines *= 2.0;
            }
            Some(f64::from(mode.htotal) * lines / f64::from(mode.dot_clock))
        })
        // A rate that is not between 10 and 1000 Hz is wrong.
        .filter(|seconds| (0.001..0.1).contains(seconds))
        .min_by(f64::total_cmp)?;
    Some(Duration::from_secs_f64(seconds))
}

impl Window for X11Window {
    fn extent(&self) -> Result<Option<[u32; 2]>, WindowLost> {
        let geometry = self.connection.get_geometry(self.window).map_err(lost)?;
        let geometry = geometry.reply().map_err(lost)?;
        Ok(Some([geometry.width.into(), geometry.height.into()]))
    }

    fn present_modes(&self) -> &'static [PresentMode] {
        &[PresentMode::Fifo, PresentMode::Mailbox, PresentMode::Immediate]
    }

    fn has_alpha(&self) -> bool {
        self.depth == 32
    }

    fn canvas(&self, options: CanvasOptions) -> Result<Box<dyn Canvas>, WindowLost> {
        let [width, height] = options.extent;
        let (Ok(width), Ok(height)) = (u16::try_from(width), u16::try_from(height)) else {
            return Err(lost(format_args!("{width}x{height} is too large for X11")));
        };
        let connection = Arc::clone(&self.connection);
        let context = connection.generate_id().map_err(lost)?;
        let created = connection.create_gc(context, self.window, &CreateGCAux::new()).map_err(lost)?;
        created.check().map_err(lost)?;
        let size = 4 * usize::from(width) * usize::from(height);
        let pixels = match Segment::new(&connection, size) {
            Some(segment) => Pixels::Shared(segment),
            None => Pixels::Sent(vec![0; size]),
        };
        Ok(Box::new(X11Canvas {
            connection,
            window: self.window,
            depth: self.depth,
            context,
            size: [width, height],
            is_opaque: !options.has_alpha && self.depth == 32,
            pixels,
            period: self.period,
            next: Instant::now(),
        }))
    }
}

/// The pixels of a picture that is sent to the server.
enum Pixels {
    /// The server reads them from shared memory.
    Shared(Segment),
    /// They are sent over the connection.
    Sent(Vec<u8>),
}

/// Memory that is shared with the server.
struct Segment {
    memory: SharedMemory,
    id: u32,
}

impl Segment {
    /// `size` bytes; `None` if the server shares no memory.
    fn new(connection: &XCBConnection, size: usize) -> Option<Self> {
        // SAFETY: the connection is open, and so is its socket.
        let socket = unsafe { BorrowedFd::borrow_raw(connection.as_raw_fd()) };
        // Descriptors can be sent only over local sockets; on another the attempt breaks the connection.
        let address = rustix::net::getsockname(socket).ok()?;
        if address.address_family() != rustix::net::AddressFamily::UNIX {
            return None;
        }
        connection.extension_information(shm::X11_EXTENSION_NAME).ok()??;
        let version = connection.shm_query_version().ok()?.reply().ok()?;
        if (version.major_version, version.minor_version) < (1, 2) {
            return None;
        }
        let memory = SharedMemory::new(size).ok()?;
        let id = connection.generate_id().ok()?;
        let attached = connection.shm_attach_fd(id, memory.own_descriptor().ok()?, true).ok()?;
        attached.check().ok()?;
        Some(Self { memory, id })
    }
}

/// A window prepared for pictures.
struct X11Canvas {
    connection: Arc<XCBConnection>,
    window: u32,
    depth: u8,
    /// A graphics context.
    context: u32,
    /// Width and height of pictures.
    size: [u16; 2],
    /// True if the pictures are opaque but the window has alpha.
    is_opaque: bool,
    pixels: Pixels,
    period: Duration,
    /// The time of the display's next refresh.
    next: Instant,
}

impl X11Canvas {
    /// Sends a picture's rows to the server, in requests as large as it accepts.
    fn send(&self, pixels: &[u8]) -> Result<(), WindowLost> {
        let [width, height] = self.size;
        let row_size = 4 * usize::from(width);
        // A request has a header of its own.
        let available = self.connection.maximum_request_bytes().saturating_sub(64);
        let rows = (available / row_size).clamp(1, usize::from(height));
        let mut y = 0;
        for part in pixels.chunks(rows * row_size) {
            let part_height = (part.len() / row_size) as u16;
            let put = self
                .connection
                .put_image(
                    ImageFormat::Z_PIXMAP,
                    self.window,
                    self.context,
                    width,
                    part_height,
                    0,
                    y,
                    0,
                    self.depth,
                    part,
                )
                .map_err(lost)?;
            y += part_height as i16;
            if y as u16 >= height {
                put.check().map_err(lost)?;
            } else {
                put.ignore_error();
            }
        }
        Ok(())
    }
}

impl Canvas for X11Canvas {
    fn wait(&mut self, longest: Duration) -> Result<bool, WindowLost> {
        let left = self.next.saturating_duration_since(Instant::now());
        std::thread::sleep(left.min(longest));
        Ok(left <= longest)
    }

    fn show(&mut self, copy: &mut dyn FnMut(&mut [u8])) -> Result<(), WindowLost> {
        // A late picture is shown at once, and later ones are paced from then on.
        self.next = (self.next + self.period).max(Instant::now());
        let pixels = match &mut self.pixels {
            Pixels::Shared(segment) => segment.memory.bytes(),
            Pixels::Sent(pixels) => pixels,
        };
        copy(pixels);
        if self.is_opaque {
            pixels.chunks_exact_mut(4).for_each(|pixel| pixel[3] = 255);
        }
        match &self.pixels {
            Pixels::Shared(segment) => {
                let [width, height] = self.size;
                let put = self
                    .connection
                    .shm_put_image(
                        self.window,
                        self.context,
                        width,
                        height,
                        0,
                        0,
                        width,
                        height,
                        0,
                        0,
                        self.depth,
                        ImageFormat::Z_PIXMAP.into(),
                        false,
                        segment.id,
                        0,
                    )
                    .map_err(lost)?;
                // The server has read the picture when it answers, so the next one may be written.
                put.check().map_err(lost)
            }
            Pixels::Sent(pixels) => self.send(pixels),
        }
    }
}

impl Drop for X11Canvas {
    fn drop(&mut self) {
        if let Pixels::Shared(segment) = &self.pixels
            && let Ok(detached) = self.connection.shm_detach(segment.id)
        {
            detached.ignore_error();
        }
        if let Ok(freed) = self.connection.free_gc(self.context) {
            freed.ignore_error();
        }
        // It doesn't matter if the server is gone.
        let _ = self.connection.flush();
    }
}
