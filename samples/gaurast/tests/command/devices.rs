//! Pictures that another Vulkan device draws.

use gaurast_runner::Need;
use gaurast_scene::Options;

use crate::encoded::compressed_ply;
use crate::support::succeeds;

/// A square of the mesh format of PLY, through the scene.
const SQUARE: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n\
                      property list uchar int vertex_indices\nend_header\n-1 -1 0\n1 -1 0\n1 1 0\n-1 1 0\n3 0 1 2\n3 0 2 3\n";

/// Lavapipe draws files, depths and meshes with this driver's pictures.
#[gaurast_runner::test(needs = [Need::Lavapipe])]
fn another_device_draws_the_same_pictures() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("codes.compressed.ply"), compressed_ply(300)).expect("written");
    let options = Options::default();
    let codes = folder.path().join("codes.compressed.ply");
    let scene = gaurast_scene::load_with(&codes, &options, |file, _| file);
    assert!(matches!(scene, Ok(gaurast_scene::Loaded::Encoded(_))), "not drawn as it lies");
    std::fs::write(folder.path().join("square.ply"), SQUARE).expect("written");
    let view = ["--eye", "0,0,-6", "--target", "0,0,0", "--fov", "50", "--size", "160x90"];
    let scenes: [&[&str]; 4] = [
        &["codes.compressed.ply"],
        &["codes.compressed.ply", "--decode"],
        &["codes.compressed.ply", "--depth"],
        &["codes.compressed.ply", "square.ply"],
    ];
    for scene in scenes {
        let drawn = |more: &[&str]| succeeds(&folder, &[scene, &view, more].concat());
        drawn(&["-o", "own.exr", "--force"]);
        drawn(&["-o", "other.exr", "--force", "--device", "llvmpipe"]);
        succeeds(&folder, &["compare", "own.exr", "other.exr", "--fail-below", "110"]);
    }
}
