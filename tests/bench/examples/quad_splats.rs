//! Draws Gaussians without the Gaussian topology: as blended quads, sorted on the processor, on any Vulkan device.
//!
//! `quad_splats [DEVICE [SCENE]]` writes quad_splats.png. It uses the loader's first device whose name contains DEVICE
//! (such as llvmpipe), or this driver if no DEVICE is given. `gaurast render` draws the same picture with the Gaussian
//! topology.

use gaurast_bench::quads::QuadRenderer;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut renderer = match arguments.next() {
        Some(device) => QuadRenderer::through_the_loader(&device, 0)?,
        None => QuadRenderer::new(vulkan_gaurast::entry(), "", 0)?,
    };
    println!("{}", renderer.device_name());
    let size = [1280, 720];
    let (scene, camera) = match arguments.next() {
        Some(path) => {
            let scene = gaurast_scene::open(path)?;
            let camera = gaurast_scene::frame(&scene, 50.0, size);
            (scene, camera)
        }
        None => (
            gaurast_scene::garden::scene(1, gaurast_scene::garden::DEFAULT_COUNT),
            gaurast_scene::garden::camera(None, size)?,
        ),
    };
    for frame in ["first", "second"] {
        let frame_drawn = renderer.render(&scene, &camera, 3, 1.0 / 255.0)?;
        println!("{frame} frame: {:?}", frame_drawn.time);
        for step in &frame_drawn.counters {
            println!("{:>10}: {:8.2} ms", step.name, step.value * 1e-6);
        }
        gaurast_picture::write("quad_splats.png".as_ref(), &frame_drawn.picture, None)?;
    }
    Ok(())
}
