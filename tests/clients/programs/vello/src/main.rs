//! vello: shapes of a scene cover as much of each pixel as their geometry says.

#[path = "../../wgpu_device.rs"]
mod wgpu_device;

use std::error::Error;

use vello::kurbo::{Affine, Circle, Point, Rect};
use vello::peniko::color::palette::css;
use vello::peniko::{Color, Fill, Gradient};
use vello::{AaConfig, AaSupport, RenderParams, Renderer, RendererOptions, Scene};

const SIZE: u32 = 256;
const CENTRE: Point = Point::new(90.3, 120.6);
const RADIUS: f64 = 60.0;

fn scene() -> Scene {
    let mut scene = Scene::new();
    let gradient = Gradient::new_linear((160.0, 0.0), (240.0, 0.0)).with_stops([css::BLACK, css::WHITE]);
    scene.fill(Fill::NonZero, Affine::IDENTITY, &gradient, None, &Rect::new(160.0, 20.0, 240.0, 60.0));
    let green = Color::from_rgb8(0, 255, 0);
    scene.fill(Fill::NonZero, Affine::IDENTITY, green, None, &Circle::new(CENTRE, RADIUS));
    // A square of 40x40 pixels on one of its corners.
    let turned = Affine::translate((200.0, 180.0)) * Affine::rotate(std::f64::consts::FRAC_PI_4);
    scene.fill(Fill::EvenOdd, turned, Color::from_rgb8(0, 0, 255), None, &Rect::new(-20.0, -20.0, 20.0, 20.0));
    scene
}

/// The pixels of the scene.
fn drawn(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Vec<[u8; 4]>, Box<dyn Error>> {
    let size = wgpu::Extent3d { width: SIZE, height: SIZE, depth_or_array_layers: 1 };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let options = RendererOptions { antialiasing_support: AaSupport::area_only(), ..Default::default() };
    let mut renderer = Renderer::new(device, options)?;
    let parameters =
        RenderParams { base_color: css::BLACK, width: SIZE, height: SIZE, antialiasing_method: AaConfig::Area };
    let view = texture.create_view(&Default::default());
    renderer.render_to_texture(device, queue, &scene(), &view, &parameters)?;
    wgpu_device::pixels(device, queue, &texture, SIZE)
}

fn main() -> Result<(), Box<dyn Error>> {
    let (adapter, device, queue) = wgpu_device::open()?;
    let pixels = drawn(&device, &queue)?;
    let at = |x: u32, y: u32| pixels[(y * SIZE + x) as usize];

    let mut areas = [0.0; 2];
    let mut shades = 0.0f64;
    for y in 0..SIZE {
        for x in 0..SIZE {
            let [_, green, blue, alpha] = at(x, y);
            assert_eq!(alpha, 255, "the background is opaque");
            let in_gradient = (160..240).contains(&x) && (20..60).contains(&y);
            if in_gradient {
                // vello takes the colour at a pixel's corner.
                let expected = f64::from(x - 160) / 80.0 * 255.0;
                shades = shades.max((f64::from(green) - expected).abs());
                continue;
            }
            let distance = Point::new(f64::from(x) + 0.5, f64::from(y) + 0.5).distance(CENTRE);
            if (distance - RADIUS).abs() > 1.0 {
                assert_eq!(green, if distance < RADIUS { 255 } else { 0 }, "the circle at {x}, {y}");
            }
            areas[0] += f64::from(green) / 255.0;
            areas[1] += f64::from(blue) / 255.0;
        }
    }
    assert!(shades <= 1.0, "the gradient is {shades} of 255 from its formula");
    let expected = [std::f64::consts::PI * RADIUS * RADIUS, 1600.0];
    let apart = [0, 1].map(|i| (areas[i] / expected[i] - 1.0).abs());
    // vello draws a circle as a polygon within a quarter of a pixel.
    assert!(apart[0] < 6e-3 && apart[1] < 1e-4, "the areas are {areas:?}, not {expected:?}");
    let name = adapter.get_info().name;
    let [circle, square] = apart;
    println!(
        "{name}: a circle's area within {circle:.1e}, a turned square's within {square:.1e}, a gradient within {shades:.2} of 255"
    );
    Ok(())
}
