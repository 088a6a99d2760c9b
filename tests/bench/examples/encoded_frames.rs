//! Times the first frames of compressed scenes as they lie and decoded: `encoded_frames RUNS FILE...` prints a row of the table in
//! docs/files.md for each file, medians of the runs. The ways take turns.

#[path = "../src/bin/gaurast-bench/median.rs"]
mod median;

use std::error::Error;
use std::path::Path;

use gaurast_render::Renderer;
use gaurast_scene::{Camera, Loaded, Options};
use median::median;

/// The frames of a run. Those after the first build clusters; later ones read them.
const FRAMES: usize = 12;
/// The first frame, those that build clusters, and the later ones.
const PARTS: [std::ops::Range<usize>; 3] = [0..1, 1..5, 5..FRAMES];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let runs: usize = arguments.next().ok_or("the number of runs")?.parse()?;
    println!(
        "| file | first frame as it lies | decoded | frames 2 to 5 as they lie | decoded | later ones as they lie | decoded |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|");
    for file in arguments {
        let path = Path::new(&file);
        let mut times = [const { Vec::new() }; 2 * PARTS.len()];
        for _ in 0..runs {
            for decoded in [false, true] {
                let of_frames = draw(path, decoded)?;
                for (part, range) in PARTS.into_iter().enumerate() {
                    let of_part = &of_frames[range];
                    times[2 * part + usize::from(decoded)].push(of_part.iter().sum::<f64>() / of_part.len() as f64);
                }
            }
        }
        let name = path.file_name().unwrap_or_default().display();
        let cells = times.map(|times| format!("{:.1}", median(times)));
        println!("| {name} | {} |", cells.join(" | "));
    }
    Ok(())
}

/// The milliseconds of each frame of a scene.
fn draw(path: &Path, decoded: bool) -> Result<Vec<f64>, Box<dyn Error>> {
    let Loaded::Encoded(scene) = gaurast_scene::load_with(path, &Options::default(), |file, _| file)? else {
        return Err(format!("{} is read decoded", path.display()).into());
    };
    let camera: Camera = gaurast_scene::frame(&scene.outline()?, 50.0, [640, 360]);
    let mut renderer = Renderer::new(vulkan_gaurast::entry())?;
    let scene = match decoded {
        true => renderer.upload_and_free(scene.decode()?, None)?,
        false => renderer.upload_encoded(*scene, None)?,
    };
    let frame = |_| Ok(renderer.render(&scene, &camera)?.time.as_secs_f64() * 1e3);
    (0..FRAMES).map(frame).collect()
}
