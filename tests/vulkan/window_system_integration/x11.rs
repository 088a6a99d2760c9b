//! Windows of X11, on a server without a screen (Xvfb) that each test starts for itself. The window shows the presented
//! pictures. Windows change their size and are destroyed, and the server may end.

use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use ash::vk;
use gaurast_runner::{Need, is_long};
use gaurast_testkit::presenter::{Presenter, SIZE, SwapchainOptions};
use gaurast_tests::long_run::memory;
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{ConfigureWindowAux, ConnectionExt, CreateWindowAux, ImageFormat, WindowClass};
use x11rb::rust_connection::RustConnection;
use x11rb::xcb_ffi::XCBConnection;

const XVFB: Need = Need::Program("Xvfb");

/// A server process, which ends with the test.
struct Server {
    process: Child,
    display: String,
}

impl Server {
    fn start(options: &[&str]) -> Self {
        let mut process = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "320x240x24"])
            .args(options)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb starts");
        // The server writes its display number when it is ready.
        let mut output = process.stdout.take().expect("its output");
        let mut number = String::new();
        let mut byte = [0];
        while output.read(&mut byte).expect("its number") == 1 && byte[0] != b'\n' {
            number.push(byte[0] as char);
        }
        assert!(!number.is_empty(), "Xvfb did not start");
        Self { process, display: format!(":{number}") }
    }

    fn stop(&mut self) {
        // The process may have ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.stop();
    }
}

/// A window on a connection of libxcb, as in applications.
struct Window {
    id: u32,
    connection: XCBConnection,
}

impl Window {
    fn open(server: &Server) -> Self {
        let display = std::ffi::CString::new(server.display.clone()).expect("a name");
        let (connection, screen) = XCBConnection::connect(Some(&display)).expect("a connection");
        let screen = &connection.setup().roots[screen];
        let id = connection.generate_id().expect("an id");
        connection
            .create_window(
                screen.root_depth,
                id,
                screen.root,
                0,
                0,
                SIZE[0] as u16,
                SIZE[1] as u16,
                0,
                WindowClass::INPUT_OUTPUT,
                screen.root_visual,
                &CreateWindowAux::new(),
            )
            .expect("a window")
            .check()
            .expect("a window");
        connection.map_window(id).expect("it is shown").check().expect("it is shown");
        Self { id, connection }
    }

    fn presenter(&self) -> Presenter {
        Presenter::new(gaurast_window::entry(), ash::khr::xcb_surface::NAME, |entry, instance| {
            let functions = ash::khr::xcb_surface::Instance::new(entry, instance);
            let info = vk::XcbSurfaceCreateInfoKHR::default()
                .connection(self.connection.get_raw_xcb_connection())
                .window(self.id);
            // SAFETY: the connection and the window outlive the surface.
            unsafe { functions.create_xcb_surface(&info, None) }.expect("a surface")
        })
    }

    fn resize(&self, [width, height]: [u32; 2]) {
        let size = ConfigureWindowAux::new().width(width).height(height);
        self.connection.configure_window(self.id, &size).expect("it is resized").check().expect("it is resized");
    }

    fn destroy(&self) {
        self.connection.destroy_window(self.id).expect("it is destroyed").check().expect("it is destroyed");
    }
}

/// The pixels that another client of the server reads from a window of [`SIZE`]: blue, green and red of each.
fn shown(server: &Server, window: u32) -> Vec<[u8; 3]> {
    let (connection, _) = RustConnection::connect(Some(&server.display)).expect("a connection");
    let [width, height] = SIZE.map(|side| side as u16);
    let image = connection
        .get_image(ImageFormat::Z_PIXMAP, window, 0, 0, width, height, u32::MAX)
        .expect("a picture")
        .reply()
        .expect("a picture");
    let pixels = image.data.chunks_exact(4);
    pixels.map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
}

/// Waits until every pixel of a window has a colour.
fn assert_shown(server: &Server, window: u32, color: [u8; 3]) {
    let end = Instant::now() + Duration::from_secs(20);
    loop {
        let pixels = shown(server, window);
        if pixels.iter().all(|pixel| *pixel == color) {
            return;
        }
        assert!(Instant::now() < end, "{:?}, not {color:?}", pixels[0]);
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn what_is_presented_is_shown(options: &[&str]) {
    let server = Server::start(options);
    let window = Window::open(&server);
    let presenter = window.presenter();
    let can = presenter.capabilities().expect("capabilities");
    let [width, height] = SIZE;
    assert_eq!(can.current_extent, vk::Extent2D { width, height });
    for mode in presenter.modes() {
        let options = SwapchainOptions { mode, count: 3, ..SwapchainOptions::default() };
        let swapchain = presenter.swapchain(&options).expect("a swapchain");
        for (color, bytes) in [([1.0, 0.2, 0.4, 1.0], [102, 51, 255]), ([0.2, 1.0, 0.0, 1.0], [0, 255, 51])] {
            for _ in 0..5 {
                assert_eq!(swapchain.frame(color).1, Ok(false), "{mode:?}");
            }
            assert_shown(&server, window.id, bytes);
        }
    }
    assert!(window.connection.poll_for_event().expect("no error").is_none());
}

#[gaurast_runner::test(needs = [XVFB])]
fn pictures_are_shown_through_shared_memory() {
    what_is_presented_is_shown(&[]);
}

#[gaurast_runner::test(needs = [XVFB])]
fn pictures_are_shown_through_the_connection() {
    what_is_presented_is_shown(&["-extension", "MIT-SHM"]);
}

/// 30 frames take at least half a second if each waits for the display, which runs at 60 Hz.
#[gaurast_runner::test(needs = [XVFB])]
fn frames_in_order_are_paced_by_the_display() {
    let server = Server::start(&[]);
    let window = Window::open(&server);
    let presenter = window.presenter();
    let swapchain = presenter.swapchain(&SwapchainOptions::default()).expect("a swapchain");
    let begin = Instant::now();
    for _ in 0..33 {
        assert_eq!(swapchain.frame([0.5; 4]).1, Ok(false));
    }
    // The last frames may still be waiting.
    let seconds = begin.elapsed().as_secs_f64();
    assert!(seconds > 0.4, "{seconds} s");
}

#[gaurast_runner::test(needs = [XVFB])]
fn a_window_changes_its_size() {
    let server = Server::start(&[]);
    let window = Window::open(&server);
    let presenter = window.presenter();
    let options = SwapchainOptions::default();
    let old = presenter.swapchain(&options).expect("a swapchain");
    assert_eq!(old.frame([0.0, 0.0, 1.0, 1.0]).1, Ok(false));
    window.resize([64, 40]);
    let can = presenter.capabilities().expect("capabilities");
    assert_eq!((can.current_extent.width, can.current_extent.height), (64, 40));
    assert_eq!(old.acquire(u64::MAX).map(|(_, suboptimal)| suboptimal), Ok(true));
    assert_eq!(old.frame([0.0, 1.0, 0.0, 1.0]).1, Ok(true));
    let options = SwapchainOptions { size: [64, 40], old: old.raw, ..options };
    let new = presenter.swapchain(&options).expect("a swapchain");
    drop(old);
    assert_eq!(new.frame([1.0, 0.0, 0.0, 1.0]).1, Ok(false));
    assert_shown(&server, window.id, [0, 0, 255]);
}

/// A window that is resized all the time, for ten minutes if a test may be long: each size has a swapchain that takes the place
/// of the last, and frames are presented in it. The process holds as much memory at the end as when all sizes have been there.
#[gaurast_runner::test(alone, needs = [XVFB])]
fn resizing_does_not_grow() {
    const SIZES: u32 = 40;
    const SAMPLE: u32 = 400;
    const SLACK: u64 = 8 << 20;
    let server = Server::start(&[]);
    let window = Window::open(&server);
    let presenter = window.presenter();
    let options = SwapchainOptions { mode: vk::PresentModeKHR::MAILBOX, ..SwapchainOptions::default() };
    let mut swapchain = presenter.swapchain(&options).expect("a swapchain");
    let (begin, mut resized, mut early) = (Instant::now(), 0, None);
    let goes_on = |resized: u32| match is_long() {
        true => begin.elapsed() < Duration::from_secs(600),
        false => resized < SAMPLE,
    };
    while goes_on(resized) {
        let size = [48 + 7 * (resized % SIZES), 200 - 4 * (resized % SIZES)];
        window.resize(size);
        // The old swapchain no longer suits the window.
        assert_eq!(swapchain.frame([1.0; 4]).1, Ok(true), "{resized}");
        let options = SwapchainOptions { size, old: swapchain.raw, ..options };
        let new = presenter.swapchain(&options).expect("a swapchain");
        drop(std::mem::replace(&mut swapchain, new));
        assert_eq!(swapchain.frame([0.5; 4]).1, Ok(false), "{resized}");
        resized += 1;
        if resized == 2 * SIZES {
            early = memory("VmRSS:");
        }
    }
    let (Some(early), Some(late)) = (early, memory("VmRSS:")) else {
        return;
    };
    println!("{resized} sizes: {early} bytes of memory, then {late}");
    assert!(late <= early + SLACK, "memory grew from {early} to {late} bytes");
}

/// Presents until the surface is lost, which it must be soon.
fn assert_lost(swapchain: &gaurast_testkit::presenter::Swapchain<'_>) {
    let end = Instant::now() + Duration::from_secs(20);
    while swapchain.frame([0.5; 4]).1 != Err(vk::Result::ERROR_SURFACE_LOST_KHR) {
        assert!(Instant::now() < end, "it can still be presented to");
    }
}

#[gaurast_runner::test(needs = [XVFB])]
fn a_window_that_is_destroyed_is_a_lost_surface() {
    let server = Server::start(&[]);
    let window = Window::open(&server);
    let presenter = window.presenter();
    let options = SwapchainOptions::default();
    let swapchain = presenter.swapchain(&options).expect("a swapchain");
    assert_eq!(swapchain.frame([0.5; 4]).1, Ok(false));
    window.destroy();
    assert_lost(&swapchain);
    let lost = Err(vk::Result::ERROR_SURFACE_LOST_KHR);
    assert_eq!(presenter.capabilities().map(|_| ()), lost);
    drop(swapchain);
    assert_eq!(presenter.swapchain(&options).map(|_| ()), lost);
}

#[gaurast_runner::test(needs = [XVFB])]
fn a_server_that_dies_is_a_lost_surface() {
    let mut server = Server::start(&[]);
    let window = Window::open(&server);
    let presenter = window.presenter();
    let options = SwapchainOptions { mode: vk::PresentModeKHR::MAILBOX, ..SwapchainOptions::default() };
    let swapchain = presenter.swapchain(&options).expect("a swapchain");
    assert_eq!(swapchain.frame([0.5; 4]).1, Ok(false));
    server.stop();
    assert_lost(&swapchain);
    assert_eq!(presenter.capabilities().map(|_| ()), Err(vk::Result::ERROR_SURFACE_LOST_KHR));
}
