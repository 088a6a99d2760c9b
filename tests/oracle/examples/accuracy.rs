//! The accuracy of a picture of a scene: `accuracy SCENE PICTURE.exr`. The picture holds premultiplied floats, as `gaurast SCENE -o
//! PICTURE.exr` or another renderer writes them, and is seen by the camera that the `gaurast` command chooses.

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

use gaurast_oracle::compare::{Accuracy, Limits};
use gaurast_oracle::oracle::{OracleCamera, OracleState, render_bounded};
use gaurast_oracle::scenes::SceneBuffers;
use gaurast_scene::camera::DEFAULT_FOV;

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, picture] = &arguments[..] else {
        return Err("the arguments are a scene and a picture in .exr".into());
    };
    let scene = gaurast_scene::open(scene)?;
    let picture = gaurast_picture::read(Path::new(picture))?;
    let size = [picture.width, picture.height];
    let camera = gaurast_scene::frame_middle(&scene, DEFAULT_FOV, size).to_vulkan();
    let camera = OracleCamera::new(&camera, size).ok_or("a camera that the oracle does not know")?;
    let buffers = SceneBuffers::from(&scene);
    // The state of the picture: 3DGS's defaults, in the order of view depth.
    let reference = render_bounded(&buffers.as_oracle(), &camera, &OracleState::default());
    let accuracy = Accuracy::of(&picture.pixels, &reference, Limits::CONTRACT);
    println!("{accuracy}");
    Ok(if accuracy.holds() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
