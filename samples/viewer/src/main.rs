//! A window in which a camera flies around a scene of Gaussians with a mesh in it: plain `ash`, `winit`, and a
//! swapchain.

#![cfg_attr(rustfmt, rustfmt_skip)] // A step a line, so that a few screens show everything.

mod gpu;

use std::f64::consts::{FRAC_PI_2, TAU};
use std::process::ExitCode;
use std::time::Instant;

use ash::vk;
use clap::Parser;
use gaurast_scene::{Extent, Scene, garden};
use glam::{DMat4, DVec3, DVec4};
use gpu::{Gpu, Outcome, Vertex, View};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, KeyEvent, WindowEvent};
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::keyboard::{Key, NamedKey};
use winit::window::{Window, WindowId};

/// The time, in seconds, of the camera's orbit around the scene and of the mesh's rotation.
const ORBIT: f64 = 20.0;
const TURN: f64 = 6.0;

/// The keys, in the window's title and in the help.
const KEYS: &str = "arrows turn, + and - zoom, space stops, Escape ends";

/// The angle in radians, and the factor of the distance, of a key press.
const STEP: f64 = 0.05;

/// Flies around a scene of Gaussians with a mesh in it
#[derive(Parser)]
#[command(after_help = format!("Keys: {KEYS}."))]
struct Arguments {
    /// The scene file [default: a generated garden]
    file: Option<std::path::PathBuf>,
    /// The window's width in pixels
    #[arg(long, default_value_t = 1280)]
    width: u32,
    /// The window's height in pixels
    #[arg(long, default_value_t = 720)]
    height: u32,
    /// Exits after this number of frames and prints the frames per second
    #[arg(long)]
    frames: Option<u32>,
    /// Does not wait for the display
    #[arg(long)]
    immediate: bool,
    /// Draws with the first driver that the Vulkan loader finds, instead of the linked one
    #[arg(long)]
    loader: bool,
}

/// The window and its device, created at the first event.
struct Viewer {
    arguments: Arguments,
    scene: Scene,
    extent: Extent,
    /// The device is dropped before the window to which it presents.
    shown: Option<(Gpu, Window)>,
    begin: Instant,
    orbit: Orbit,
    frames: u32,
    outcome: Outcome<()>,
}

/// The camera's place around the scene's centre.
struct Orbit {
    /// The angles around the scene and above the horizon, in radians.
    azimuth: f64,
    elevation: f64,
    /// The distance from the centre, in radii of the scene.
    distance: f64,
    /// True until the space key stops it.
    moves: bool,
    /// The seconds at which it was moved last.
    seconds: f64,
}

impl Orbit {
    /// The camera moves on until this second.
    fn advance(&mut self, seconds: f64) {
        if self.moves { self.azimuth += TAU * (seconds - self.seconds) / ORBIT }
        self.seconds = seconds;
    }

    /// Follows a key.
    fn follow(&mut self, key: &Key) {
        match key.as_ref() {
            Key::Named(NamedKey::ArrowLeft) => self.azimuth -= STEP,
            Key::Named(NamedKey::ArrowRight) => self.azimuth += STEP,
            Key::Named(NamedKey::ArrowUp) => self.elevation = (self.elevation + STEP).min(FRAC_PI_2 - STEP),
            Key::Named(NamedKey::ArrowDown) => self.elevation = (self.elevation - STEP).max(STEP - FRAC_PI_2),
            Key::Named(NamedKey::Space) => self.moves = !self.moves,
            Key::Character("+" | "=") => self.distance *= 1.0 - STEP,
            Key::Character("-") => self.distance *= 1.0 + STEP,
            _ => {}
        }
    }
}

impl Default for Orbit {
    fn default() -> Self {
        Self { azimuth: 0.0, elevation: 0.34, distance: 1.48, moves: true, seconds: 0.0 }
    }
}

impl Viewer {
    fn open(&mut self, events: &ActiveEventLoop) -> Outcome<()> {
        let size = PhysicalSize::new(self.arguments.width, self.arguments.height);
        let window = events.create_window(Window::default_attributes().with_title(format!("GauRast: {KEYS}")).with_inner_size(size))?;
        // SAFETY: the system's loader is sound.
        let entry = if self.arguments.loader { unsafe { ash::Entry::load()? } } else { gaurast_window::entry() };
        let (fifo, immediate) = (vk::PresentModeKHR::FIFO, vk::PresentModeKHR::IMMEDIATE);
        let mode = if self.arguments.immediate { immediate } else { fifo };
        self.shown = Some((Gpu::new(entry, &window, mode, &self.scene, &torus())?, window));
        self.begin = Instant::now();
        Ok(())
    }

    fn draw(&mut self, events: &ActiveEventLoop) -> Outcome<()> {
        let Some((gpu, window)) = &mut self.shown else { return Ok(()) };
        let PhysicalSize { width, height } = window.inner_size();
        // A minimized window has no pixels; it requests a redraw when it is shown again.
        if width == 0 || height == 0 {
            return Ok(());
        }
        let seconds = self.begin.elapsed().as_secs_f64();
        self.orbit.advance(seconds);
        gpu.draw([width, height], &view(&self.extent, &self.orbit, f64::from(height) / f64::from(width)))?;
        self.frames += 1;
        if self.arguments.frames == Some(self.frames) {
            gpu.wait()?;
            let seconds = self.begin.elapsed().as_secs_f64();
            println!("{} frames in {seconds:.2} s: {:.2} a second", self.frames, f64::from(self.frames) / seconds);
            events.exit();
        }
        window.request_redraw();
        Ok(())
    }

    /// Ends the program if a step failed.
    fn check(&mut self, events: &ActiveEventLoop, outcome: Outcome<()>) {
        if outcome.is_err() {
            self.outcome = outcome;
            events.exit();
        }
    }
}

impl ApplicationHandler for Viewer {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.shown.is_none() {
            let opened = self.open(events);
            self.check(events, opened);
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::KeyboardInput { event: KeyEvent { logical_key, state: ElementState::Pressed, .. }, .. } => {
                if logical_key == Key::Named(NamedKey::Escape) { events.exit() } else { self.orbit.follow(&logical_key); }
            }
            WindowEvent::RedrawRequested | WindowEvent::Resized(_) => {
                let drawn = self.draw(events);
                self.check(events, drawn);
            }
            _ => {}
        }
    }
}

/// The view from a place around the scene's centre. The camera looks along +z, with x to the right and y downwards. The mesh
/// rotates at the centre.
fn view(extent: &Extent, orbit: &Orbit, aspect: f64) -> View {
    let (centre, radius) = (DVec3::from_array(extent.centre), extent.radius());
    let ((sin, cos), (up, level)) = (orbit.azimuth.sin_cos(), orbit.elevation.sin_cos());
    let eye = centre + radius * orbit.distance * DVec3::new(level * sin, -up, -level * cos);
    let forward = (centre - eye).normalize();
    let right = DVec3::Y.cross(forward).normalize();
    let down = forward.cross(right);
    let rotation = DMat4::from_cols(right.extend(0.0), down.extend(0.0), forward.extend(0.0), DVec4::W);
    let focal = 1.0 / (0.5 * 50f64.to_radians()).tan();
    let (near, far) = (extent.near(), 20.0 * radius);
    let slope = far / (far - near);
    let projection = DMat4::from_cols(
        DVec4::X * focal * aspect, DVec4::Y * focal, DVec4::new(0.0, 0.0, slope, 1.0), DVec4::Z * -slope * near,
    );
    let turn = TAU * orbit.seconds / TURN;
    let mesh = DMat4::from_translation(centre) * DMat4::from_rotation_y(turn) * DMat4::from_rotation_x(0.5 * turn)
        * DMat4::from_scale(DVec3::splat(0.22 * radius));
    View { world_to_view: rotation.transpose() * DMat4::from_translation(-eye), projection, mesh }
}

/// A ring of radius 1, as triangles.
fn torus() -> Vec<Vertex> {
    const AROUND: u32 = 48;
    const ACROSS: u32 = 24;
    let vertex = |i: u32, j: u32| {
        let (sin, cos) = (std::f32::consts::TAU * i as f32 / AROUND as f32).sin_cos();
        let (up, out) = (std::f32::consts::TAU * j as f32 / ACROSS as f32).sin_cos();
        let position = [(0.75 + 0.25 * out) * cos, (0.75 + 0.25 * out) * sin, 0.25 * up];
        [position, [out * cos, out * sin, up]]
    };
    let squares = (0..AROUND).flat_map(|i| (0..ACROSS).map(move |j| (i, j)));
    squares.flat_map(|(i, j)| {
        [(0, 0), (1, 0), (1, 1), (0, 0), (1, 1), (0, 1)].map(|(di, dj)| vertex(i + di, j + dj))
    }).collect()
}

fn main() -> ExitCode {
    match run(Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("gaurast-viewer: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The sentence on a system without a display, from winit's error, which may begin with a place in its source.
fn no_display(error: &str) -> String {
    let reason = error.rsplit(": ").next().unwrap_or(error).trim_end_matches('.');
    format!("there is no display for a window: {reason}; the command gaurast draws without one")
}

fn run(arguments: Arguments) -> Outcome<()> {
    let events = EventLoop::new().map_err(|error| no_display(&error.to_string()))?;
    let scene = match &arguments.file {
        Some(file) => gaurast_scene::open(file)?,
        None => garden::scene(0, garden::DEFAULT_COUNT),
    };
    let (mut extent, begin) = (Extent::of(&scene), Instant::now());
    // The positions on the device are relative to the origin.
    extent.centre = std::array::from_fn(|axis| extent.centre[axis] - scene.origin()[axis]);
    let (orbit, outcome) = (Orbit::default(), Ok(()));
    let mut viewer = Viewer { arguments, scene, extent, shown: None, begin, orbit, frames: 0, outcome };
    events.run_app(&mut viewer)?;
    viewer.outcome
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_display_is_one_sentence() {
        let error = "os error at src/mod.rs:765: neither WAYLAND_DISPLAY nor DISPLAY is set.";
        let said = "there is no display for a window: neither WAYLAND_DISPLAY nor DISPLAY is set; the command gaurast draws without one";
        assert_eq!(no_display(error), said);
    }

    #[test]
    fn keys_turn_and_stop_the_camera() {
        let mut orbit = Orbit::default();
        orbit.advance(ORBIT / 4.0);
        assert!((orbit.azimuth - TAU / 4.0).abs() < 1e-12);
        orbit.follow(&Key::Named(NamedKey::Space));
        orbit.advance(ORBIT);
        assert!((orbit.azimuth - TAU / 4.0).abs() < 1e-12);
        orbit.follow(&Key::Named(NamedKey::ArrowLeft));
        assert!((orbit.azimuth - TAU / 4.0 + STEP).abs() < 1e-12);
        for _ in 0..100 { orbit.follow(&Key::Named(NamedKey::ArrowUp)) }
        assert!(orbit.elevation < FRAC_PI_2);
        let before = orbit.distance;
        orbit.follow(&Key::Character("+".into()));
        assert!(orbit.distance < before);
    }
}
