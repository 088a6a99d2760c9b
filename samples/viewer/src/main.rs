//! A window in which a camera flies around a scene of Gaussians with a mesh in it: plain `ash`, `winit`, and a swapchain.

mod gpu;

use std::error::Error;
use std::time::Instant;

use ash::vk;
use clap::Parser;
use gaurast_scene::Extent;
use glam::{DMat4, DVec3, DVec4};
use gpu::{Gpu, Vertex, View};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::window::{Window, WindowId};

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Seconds that the camera takes around the scene, and the mesh around itself.
const ORBIT: f64 = 20.0;
const TURN: f64 = 6.0;

/// Flies around a scene of Gaussians with a mesh in it.
#[derive(clap::Parser)]
struct Arguments {
    /// The scene; a garden without one.
    file: Option<std::path::PathBuf>,
    /// The window's width in pixels.
    #[arg(long, default_value_t = 1280)]
    width: u32,
    /// The window's height in pixels.
    #[arg(long, default_value_t = 720)]
    height: u32,
    /// After so many frames, say how many there were in a second, and end.
    #[arg(long)]
    frames: Option<u32>,
    /// Don't wait for the display.
    #[arg(long)]
    immediate: bool,
    /// Draw with the first driver that the Vulkan loader finds, instead of the one that is linked in.
    #[arg(long)]
    loader: bool,
}

/// The window and what is shown in it, from the first event on.
struct Viewer {
    arguments: Arguments,
    scene: gaurast_scene::Scene,
    extent: Extent,
    // Vulkan's objects go before the window that they present to.
    gpu: Option<Gpu>,
    window: Option<Window>,
    begin: Instant,
    frames: u32,
    outcome: Outcome<()>,
}

impl Viewer {
    fn open(&mut self, events: &ActiveEventLoop) -> Outcome<()> {
        let Arguments { width, height, .. } = self.arguments;
        let attributes = Window::default_attributes()
            .with_title("GauRast")
            .with_inner_size(PhysicalSize::new(width, height));
        let window = events.create_window(attributes)?;
        let entry = if self.arguments.loader {
            // SAFETY: the system's loader is sound.
            unsafe { ash::Entry::load()? }
        } else {
            vulkan_gaurast_window::entry()
        };
        let mode = if self.arguments.immediate {
            vk::PresentModeKHR::IMMEDIATE
        } else {
            vk::PresentModeKHR::FIFO
        };
        self.gpu = Some(Gpu::new(entry, &window, mode, &self.scene, &torus())?);
        self.window = Some(window);
        self.begin = Instant::now();
        Ok(())
    }

    fn draw(&mut self, events: &ActiveEventLoop) -> Outcome<()> {
        let (Some(gpu), Some(window)) = (&mut self.gpu, &self.window) else {
            return Ok(());
        };
        let PhysicalSize { width, height } = window.inner_size();
        // There is nothing to draw to while the window is minimized; it asks again when it is not.
        if width == 0 || height == 0 {
            return Ok(());
        }
        let view = view(
            &self.extent,
            self.begin.elapsed().as_secs_f64(),
            [width, height],
        );
        gpu.draw([width, height], &view)?;
        self.frames += 1;
        if self.arguments.frames == Some(self.frames) {
            gpu.wait()?;
            let seconds = self.begin.elapsed().as_secs_f64();
            let rate = f64::from(self.frames) / seconds;
            println!(
                "{} frames in {seconds:.2} s: {rate:.2} a second",
                self.frames
            );
            events.exit();
        }
        window.request_redraw();
        Ok(())
    }

    /// Ends the program where something failed.
    fn check(&mut self, events: &ActiveEventLoop, outcome: Outcome<()>) {
        if outcome.is_err() {
            self.outcome = outcome;
            events.exit();
        }
    }
}

impl ApplicationHandler for Viewer {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.window.is_none() {
            let opened = self.open(events);
            self.check(events, opened);
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::RedrawRequested => {
                let drawn = self.draw(events);
                self.check(events, drawn);
            }
            WindowEvent::Resized(_) => self.window.iter().for_each(Window::request_redraw),
            _ => {}
        }
    }
}

/// The camera after so many seconds: it looks along +z, with x to the right and y downwards, from a circle about the scene's
/// middle; and the mesh, which turns there.
fn view(extent: &Extent, seconds: f64, [width, height]: [u32; 2]) -> View {
    let (centre, radius) = (DVec3::from_array(extent.centre), extent.radius());
    let angle = std::f64::consts::TAU * seconds / ORBIT;
    let down = DVec3::Y;
    let eye = centre + radius * 1.4 * DVec3::new(angle.sin(), -0.35, -angle.cos());
    let forward = (centre - eye).normalize();
    let right = down.cross(forward).normalize();
    let rotation = DMat4::from_cols(
        right.extend(0.0),
        forward.cross(right).extend(0.0),
        forward.extend(0.0),
        DVec4::W,
    );
    let world_to_view = rotation.transpose() * DMat4::from_translation(-eye);
    let focal = 1.0 / (0.5 * 50f64.to_radians()).tan();
    let (near, far) = (extent.near(), 20.0 * radius);
    let slope = far / (far - near);
    let projection = DMat4::from_cols(
        DVec4::new(focal * f64::from(height) / f64::from(width), 0.0, 0.0, 0.0),
        DVec4::new(0.0, focal, 0.0, 0.0),
        DVec4::new(0.0, 0.0, slope, 1.0),
        DVec4::new(0.0, 0.0, -slope * near, 0.0),
    );
    let turn = std::f64::consts::TAU * seconds / TURN;
    let mesh = DMat4::from_translation(centre)
        * DMat4::from_rotation_y(turn)
        * DMat4::from_rotation_x(0.5 * turn)
        * DMat4::from_scale(DVec3::splat(0.22 * radius));
    View {
        world_to_view,
        projection,
        mesh,
    }
}

/// A ring of radius 1, as triangles.
fn torus() -> Vec<Vertex> {
    const AROUND: u32 = 48;
    const ACROSS: u32 = 24;
    let vertex = |i: u32, j: u32| {
        let u = std::f32::consts::TAU * i as f32 / AROUND as f32;
        let v = std::f32::consts::TAU * j as f32 / ACROSS as f32;
        let normal = [v.cos() * u.cos(), v.cos() * u.sin(), v.sin()];
        let middle = [0.75 * u.cos(), 0.75 * u.sin(), 0.0];
        Vertex {
            position: std::array::from_fn(|axis| middle[axis] + 0.25 * normal[axis]),
            normal,
        }
    };
    let squares = (0..AROUND).flat_map(|i| (0..ACROSS).map(move |j| (i, j)));
    squares
        .flat_map(|(i, j)| {
            let corners = [(0, 0), (1, 0), (1, 1), (0, 0), (1, 1), (0, 1)];
            corners.map(|(di, dj)| vertex(i + di, j + dj))
        })
        .collect()
}

fn main() -> Outcome<()> {
    let arguments = Arguments::parse();
    let scene = match &arguments.file {
        Some(file) => gaurast_scene::open(file)?,
        None => gaurast_scene::garden::scene(0, gaurast_scene::garden::DEFAULT_COUNT),
    };
    let events = EventLoop::new()?;
    let mut viewer = Viewer {
        extent: Extent::of(&scene),
        arguments,
        scene,
        gpu: None,
        window: None,
        begin: Instant::now(),
        frames: 0,
        outcome: Ok(()),
    };
    events.run_app(&mut viewer)?;
    viewer.outcome
}
