//! Counts pairs of tiles and Gaussians in generated scenes of the paper's sizes, over the camera paths of the paper's
//! data set: `paper_scenes FOLDER [VIEWS] > simdevice/timing/studies/generated_scenes.toml`. FOLDER has bicycle.json,
//! garden.json, room.json and bonsai.json, which are cameras.json files of the original 3DGS code.
//!
//! The scenes are generated gardens. They share only the counts of Gaussians and picture sizes with the paper's scenes. A
//! path is moved and scaled so that it goes around the garden's centre at the distance for which the garden is made.

use std::error::Error;
use std::path::Path;

use gaurast_render::Renderer;
use gaurast_scene::Camera;
use glam::{DMat3, DQuat, DVec3};

/// Name, Gaussians, picture size, and the scene whose camera path is used.
const SCENES: [(&str, usize, [u32; 2], &str); 7] = [
    ("bicycle", 6_131_954, [1237, 822], "bicycle"),
    ("stump", 4_961_797, [1245, 825], "garden"),
    ("garden", 5_834_784, [1297, 840], "garden"),
    ("room", 1_593_376, [1557, 1038], "room"),
    ("counter", 1_222_956, [1558, 1038], "room"),
    ("kitchen", 1_852_335, [1558, 1039], "room"),
    ("bonsai", 1_244_819, [1559, 1039], "bonsai"),
];

/// The counters that are kept, by category and name, and their names in the output.
const KEPT: [(&str, &str); 4] = [
    ("tile pairs", "pairs"),
    ("tile pairs evaluated", "needed"),
    ("block evaluations", "blocks"),
    ("gaussians drawn", "drawn"),
];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().ok_or("a folder of cameras.json files")?;
    let views: usize = arguments.next().map_or(Ok(8), |text| text.parse())?;
    println!("# Means over {views} views of generated gardens; written by tests/bench/examples/paper_scenes.rs.");
    for (name, count, size, path) in SCENES {
        let file = Path::new(&folder).join(format!("{path}.json"));
        let path_cameras: Vec<_> =
            gaurast_scene::camera_files::load(&file, size)?.into_iter().map(|view| view.camera).collect();
        let cameras = around_the_garden(&path_cameras, size, views)?;
        let mut renderer = Renderer::new(vulkan_gaurast::entry())?;
        // The host's copy is dropped once the device has its own.
        let scene = renderer.upload(&gaurast_scene::garden::scene(1, count), Some(0))?;
        let mut sums = [0.0; KEPT.len()];
        for camera in &cameras {
            let frame = renderer.render(&scene, camera)?;
            for (sum, (counter, _)) in sums.iter_mut().zip(KEPT) {
                let found = frame.counters.iter().find(|known| known.name == counter);
                *sum += found.ok_or(counter)?.value;
            }
        }
        println!("\n[[scene]]\nname = \"{name}\"\npath = \"{path}\"");
        println!("gaussians = {count}\nsize = [{}, {}]", size[0], size[1]);
        for (sum, (_, key)) in sums.iter().zip(KEPT) {
            println!("{key} = {:.0}", sum / cameras.len() as f64);
        }
    }
    Ok(())
}

/// `count` cameras of the path, evenly, as they would look at the garden.
fn around_the_garden(path: &[Camera], size: [u32; 2], count: usize) -> Result<Vec<Camera>, Box<dyn Error>> {
    let garden = gaurast_scene::garden::camera(None, size)?;
    let axes = |camera: &Camera| camera.rotation.map(DVec3::from_array);
    let [_, down, forward] = axes(&garden);
    let eye = DVec3::from_array(garden.eye);
    // The garden's camera looks at the garden's centre, one unit above the ground, from 6.08 units away.
    let distance = DVec3::new(2.3, 0.55, 5.6).length();
    let middle = eye + forward * distance;
    // The ground is level: the down direction of the garden's camera without the camera's tilt.
    let tilt = (0.55 / distance).asin();
    let down = down * tilt.cos() + forward * tilt.sin();

    let center = looked_at(path);
    let mean_down: DVec3 = path.iter().map(|camera| axes(camera)[1]).sum();
    let mean_distance =
        path.iter().map(|camera| DVec3::from_array(camera.eye).distance(center)).sum::<f64>() / path.len() as f64;
    let turn = DQuat::from_rotation_arc(mean_down.normalize(), down.normalize());
    let scale = distance / mean_distance;
    let moved = |camera: &Camera| {
        let eye = middle + turn * (DVec3::from_array(camera.eye) - center) * scale;
        let rotation = axes(camera).map(|axis| (turn * axis).to_array());
        let camera = camera.resized(size);
        Camera { rotation, eye: eye.to_array(), ..camera }
    };
    let step = path.len() / count.clamp(1, path.len());
    Ok(path.iter().step_by(step).take(count).map(moved).collect())
}

/// The point that is nearest to all lines of sight.
fn looked_at(path: &[Camera]) -> DVec3 {
    let (mut matrix, mut vector) = (DMat3::ZERO, DVec3::ZERO);
    for camera in path {
        let along = DVec3::from_array(camera.rotation[2]);
        let across = DMat3::IDENTITY - DMat3::from_cols(along * along.x, along * along.y, along * along.z);
        matrix += across;
        vector += across * DVec3::from_array(camera.eye);
    }
    matrix.inverse() * vector
}
