//! Tests of `gaurast eval`: folders as trainers leave them, with a generated scene whose photographs are drawn with noise.

use std::fmt::Write;
use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;

use super::support::{gaurast, succeeds, text};

/// The number of photographs.
const COUNT: usize = 17;

/// The photographs' size.
const SIZE: [u32; 2] = [48, 36];

#[track_caller]
fn evaluated(folder: &TempDir, arguments: &[&str]) -> Value {
    serde_json::from_str(&succeeds(folder, arguments)).expect("JSON")
}

#[track_caller]
fn fails(folder: &TempDir, arguments: &[&str], message: &str) {
    let output = gaurast(folder.path(), arguments);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {stderr}");
    assert_eq!(stderr.lines().filter(|line| line.contains(message)).count(), 1, "{arguments:?}: {stderr}");
}

fn write(folder: &TempDir, name: &str, text: &str) {
    let path = folder.path().join(name);
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("folders");
    std::fs::write(path, text).expect("written");
}

fn read(folder: &TempDir, name: &str) -> String {
    std::fs::read_to_string(folder.path().join(name)).expect(name)
}

/// Pseudorandom numbers from 0 to 255.
struct Noise(u32);

impl Noise {
    fn next(&mut self) -> i32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 24) as i32
    }
}

/// A PLY file of 150 round Gaussians before the cameras.
fn scene() -> String {
    placed_scene(|place| place, 1.0).0
}

/// The scene with its Gaussians elsewhere and scaled, and the places where they were.
fn placed_scene(place: impl Fn([f64; 3]) -> [f64; 3], scaled: f64) -> (String, Vec<[f64; 3]>) {
    let mut places = Vec::new();
    let mut text = "ply\nformat ascii 1.0\nelement vertex 150\n".to_owned();
    let properties = "x y z scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3 opacity f_dc_0 f_dc_1 f_dc_2";
    for property in properties.split(' ') {
        writeln!(text, "property float {property}").expect("memory");
    }
    text += "end_header\n";
    let mut noise = Noise(1);
    let mut part = || f64::from(noise.next()) / 255.0;
    for _ in 0..150 {
        let [x, y, z] = [4.0 * part() - 2.0, 3.0 * part() - 1.5, part()];
        let [scale, r, g, b] = [-2.5 + part(), 3.0 * part() - 1.5, 3.0 * part() - 1.5, 3.0 * part() - 1.5];
        places.push([x, y, z]);
        let ([x, y, z], scale) = (place([x, y, z]), scale + scaled.ln());
        writeln!(text, "{x} {y} {z} {scale} {scale} {scale} 1 0 0 0 2 {r} {g} {b}").expect("memory");
    }
    (text, places)
}

/// The position of a camera, which looks along +z.
fn position(index: usize) -> [f64; 3] {
    [0.1 * index as f64 - 0.8, 0.05 * (index % 5) as f64, -4.0]
}

/// The output folder of 3DGS, `out`, and its photographs, `data/images`: what the model draws over white, which is in `clean`,
/// with noise that is stronger in later ones.
fn inria() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    write(&folder, "out/point_cloud/iteration_30000/point_cloud.ply", &scene());
    let cfg_args = "Namespace(sh_degree=3, source_path='data', model_path='out', images='images', resolution=-1, \
                    white_background=True, data_device='cuda', eval=True)";
    write(&folder, "out/cfg_args", cfg_args);
    let [width, height] = SIZE;
    let camera = |index: usize| {
        let [x, y, z] = position(index);
        format!(
            r#"{{"id": {index}, "img_name": "p{index:02}", "width": {width}, "height": {height},
                "position": [{x}, {y}, {z}], "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "fx": 50, "fy": 50}}"#
        )
    };
    // As 3DGS writes them: those of the test come first.
    let order = (0..COUNT).filter(|at| at % 8 == 0).chain((0..COUNT).filter(|at| at % 8 != 0));
    let cameras: Vec<String> = order.map(camera).collect();
    write(&folder, "out/cameras.json", &format!("[{}]", cameras.join(",")));
    succeeds(&folder, &["out", "--view", "all", "-o", "clean/"]);
    std::fs::create_dir_all(folder.path().join("data/images")).expect("folders");
    for index in 0..COUNT {
        let name = format!("p{index:02}.png");
        let mut picture = image::open(folder.path().join("clean").join(&name)).expect("drawn").to_rgb8();
        let mut noise = Noise(index as u32 + 9);
        for byte in picture.iter_mut() {
            let added = (noise.next() - 128) * (index as i32 + 4) / 256;
            *byte = (i32::from(*byte) + added).clamp(0, 255) as u8;
        }
        picture.save(folder.path().join("data/images").join(&name)).expect("written");
    }
    folder
}

/// The PSNR of two pictures' bytes from column `first` on, after `change` of the first one's.
fn psnr(folder: &TempDir, a: &str, b: &str, first: u32, change: impl Fn(f64) -> f64) -> f64 {
    let picture = |name: &str| image::open(folder.path().join(name)).expect(name).to_rgb8();
    let (a, b) = (picture(a), picture(b));
    let pairs = a.enumerate_pixels().zip(b.pixels()).filter(|((x, ..), _)| *x >= first);
    let (mut squares, mut count) = (0.0, 0.0);
    for ((_, _, a), b) in pairs {
        for channel in 0..3 {
            squares += (change(f64::from(a.0[channel])) - f64::from(b.0[channel])).powi(2);
            count += 1.0;
        }
    }
    20.0 * 255.0_f64.log10() - 10.0 * (squares / count).log10()
}

#[track_caller]
fn close(value: &Value, expected: f64, tolerance: f64) {
    let value = value.as_f64().expect("a number");
    assert!((value - expected).abs() <= tolerance, "{value} {expected}");
}

#[gaurast_runner::test]
fn a_folder_of_3dgs_is_measured_as_3dgs_measures_it() {
    let folder = inria();
    let json = evaluated(&folder, &["eval", "out", "--json", "-o", "measured"]);
    let choices = &json["choices"];
    let said = |subject: &str| choices[subject].as_str().expect(subject).to_owned();
    assert!(said("views").starts_with("3 of 17: every 8th by name"), "{choices}");
    assert_eq!(said("background"), "1, 1, 1");
    assert!(said("sizes").starts_with("as 3DGS trains"), "{choices}");
    assert!(said("values").starts_with("8-bit"), "{choices}");
    assert_eq!([said("cameras"), said("photographs")], ["out/cameras.json", "data/images"]);
    let views = json["views"].as_array().expect("views");
    let mut sum = 0.0;
    for (view, name) in views.iter().zip(["p00", "p08", "p16"]) {
        assert_eq!(view["name"], name);
        let [clean, photograph] = [format!("clean/{name}.png"), format!("data/images/{name}.png")];
        let expected = psnr(&folder, &clean, &photograph, 0, |byte| byte);
        close(&view["psnr"], expected, 1e-4);
        sum += expected;
        // The pictures that were compared are those that `compare` compares.
        let compared = evaluated(&folder, &["compare", &clean, &photograph, "--json"]);
        for measure in ["psnr", "ssim", "ssim_torchmetrics", "flip", "largest"] {
            assert_eq!(view[measure], compared["pictures"][0][measure], "{name} {measure}");
        }
        for (written, source) in [("renders", clean), ("gt", photograph)] {
            let picture = |name: &str| image::open(folder.path().join(name)).expect(name).to_rgb8();
            assert_eq!(picture(&format!("measured/{written}/{name}.png")), picture(&source), "{name} {written}");
        }
    }
    assert_eq!(views.len(), 3);
    close(&json["mean"]["psnr"], sum / 3.0, 1e-4);
    // The files say the same. The worst view, that of the strongest noise, is the page's first.
    let stored: Value = serde_json::from_str(&read(&folder, "measured/eval.json")).expect("JSON");
    assert_eq!(stored, json);
    let csv = read(&folder, "measured/eval.csv");
    assert_eq!(csv.lines().count(), 4, "{csv}");
    assert!(csv.lines().nth(1).is_some_and(|line| line.starts_with("p00,48,36,")), "{csv}");
    let page = read(&folder, "measured/index.html");
    let places = ["p16", "p08", "p00"].map(|name| page.find(&format!("<h2>{name}</h2>")).expect(name));
    assert!(places.is_sorted(), "{places:?}");
    assert!(folder.path().join("measured/differences/p16.png").is_file());
}

#[gaurast_runner::test]
fn shares_and_a_stopped_run_give_the_same_results() {
    let folder = inria();
    let whole = succeeds(&folder, &["eval", "out", "-o", "whole"]);
    assert!(whole.contains("mean of 3"), "{whole}");
    for share in ["1/3", "0/3"] {
        succeeds(&folder, &["eval", "out", "-o", "shared", "--shard", share]);
        assert!(!folder.path().join("shared/eval.json").exists(), "{share}");
    }
    succeeds(&folder, &["eval", "out", "-o", "shared", "--shard", "2/3"]);
    let of_whole = ["eval.json", "eval.csv"].map(|name| read(&folder, &format!("whole/{name}")));
    assert_eq!(["eval.json", "eval.csv"].map(|name| read(&folder, &format!("shared/{name}"))), of_whole);
    fails(&folder, &["eval", "out", "-o", "shared"], "it is there already");
    std::fs::remove_file(folder.path().join("shared/views/p08.json")).expect("removed");
    std::fs::remove_file(folder.path().join("shared/eval.csv")).expect("removed");
    succeeds(&folder, &["eval", "out", "-o", "shared", "--resume"]);
    assert_eq!(read(&folder, "shared/eval.csv"), of_whole[1]);
    fails(&folder, &["eval", "out", "-o", "shared", "--resume", "--values", "float"], "with other choices");
    succeeds(&folder, &["eval", "out", "-o", "shared", "--force", "--values", "float"]);
}

#[gaurast_runner::test]
fn views_and_sizes_are_chosen() {
    let folder = inria();
    let names = |more: &[&str]| -> Vec<String> {
        let json = evaluated(&folder, &[&["eval", "out", "--json"], more].concat());
        let views = json["views"].as_array().expect("views");
        views.iter().map(|view| view["name"].as_str().expect("a name").to_owned()).collect()
    };
    assert_eq!(names(&["--split", "all"]).len(), COUNT);
    assert_eq!(names(&["--split", "every:6"]), ["p00", "p06", "p12"]);
    assert_eq!(names(&["--split", "fraction"]), ["p15"]);
    write(&folder, "list.txt", "p03.png\np11\n");
    assert_eq!(names(&["--split", "list.txt"]), ["p03", "p11"]);
    write(&folder, "list.txt", "p03\nq\n");
    fails(&folder, &["eval", "out", "--split", "list.txt"], "no camera is called q");
    // Half the size: the photograph as PIL resizes it, and the camera with it.
    let json = evaluated(&folder, &["eval", "out", "--scale", "2", "--json"]);
    assert_eq!([&json["views"][0]["width"], &json["views"][0]["height"]], [24, 18]);
    // Masked pixels are black in both pictures: those of a black mask are equal.
    for name in ["p00", "p08", "p16"] {
        let path = folder.path().join(format!("masks/{name}.png"));
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("folders");
        image::GrayImage::new(SIZE[0], SIZE[1]).save(path).expect("written");
    }
    let json = evaluated(&folder, &["eval", "out", "--masks", "masks", "--json"]);
    assert_eq!(json["mean"]["equal"], 3);
}

#[gaurast_runner::test]
fn photographs_too_many_are_named_and_too_few_are_an_error() {
    let folder = inria();
    let photograph = |name: &str| folder.path().join("data/images").join(name);
    std::fs::copy(photograph("p01.png"), photograph("z.png")).expect("copied");
    let output = gaurast(folder.path(), &["eval", "out"]);
    let stderr = text(&output.stderr);
    assert!(stderr.contains("1 photograph without a camera left out: z"), "{stderr}");
    std::fs::remove_file(photograph("p08.png")).expect("removed");
    fails(&folder, &["eval", "out"], "1 photograph missing: p08");
    fails(&folder, &["eval", "out", "nowhere"], "nowhere");
    fails(&folder, &["eval", "clean/p00.png"], "no file of a trainer says");
    fails(&folder, &["eval", "out", "--images", "images_4"], "there is no folder of photographs");
    write(&folder, "gsplat/ckpts/ckpt_29999_rank0.pt", "");
    fails(&folder, &["eval", "gsplat", "data"], "a training checkpoint of gsplat");
}

#[gaurast_runner::test]
fn trained_exposures_change_the_right_half() {
    let folder = inria();
    let cfg_args = read(&folder, "out/cfg_args").replace("eval=True", "eval=True, train_test_exp=True");
    write(&folder, "out/cfg_args", &cfg_args);
    let half = r#"{"p08": [[0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 0.5, 0]]}"#;
    write(&folder, "out/exposure.json", half);
    let json = evaluated(&folder, &["eval", "out", "--json", "--values", "float"]);
    let view = &json["views"][1];
    assert_eq!([&view["width"], &view["height"]], [24, 36]);
    let expected = psnr(&folder, "clean/p08.png", "data/images/p08.png", 24, |byte| 0.5 * byte);
    // The drawn picture is not rounded, the one in the folder is.
    close(&view["psnr"], expected, 0.02);
}

#[gaurast_runner::test]
fn a_folder_of_nerfstudio_is_measured_as_nerfstudio_measures_it() {
    let folder = inria();
    write(&folder, "ns/splat.ply", &scene());
    write(
        &folder,
        "ns/dataparser_transforms.json",
        r#"{"transform": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]], "scale": 1}"#,
    );
    let frame = |index: usize| {
        let [x, y, z] = position(index);
        format!(
            r#"{{"file_path": "images/p{index:02}.png",
                "transform_matrix": [[1, 0, 0, {x}], [0, -1, 0, {y}], [0, 0, -1, {z}], [0, 0, 0, 1]]}}"#
        )
    };
    let frames: Vec<String> = (0..COUNT).rev().map(frame).collect();
    let transforms = |lists: &str| {
        let [width, height] = SIZE;
        format!(r#"{{"w": {width}, "h": {height}, "fl_x": 50, "fl_y": 50, {lists} "frames": [{}]}}"#, frames.join(","))
    };
    write(&folder, "data/transforms.json", &transforms(""));
    let arguments = ["eval", "ns", "data", "--background", "white", "--json"];
    let json = evaluated(&folder, &arguments);
    assert_eq!(json["views"].as_array().map(Vec::len), Some(1), "{json}");
    let view = &json["views"][0];
    // numpy: np.setdiff1d(np.arange(17), np.linspace(0, 16, 16, dtype=int))
    assert_eq!(view["name"], "p15");
    assert!(json["choices"]["values"].as_str().is_some_and(|values| values.starts_with("float")), "{json}");
    let expected = psnr(&folder, "clean/p15.png", "data/images/p15.png", 0, |byte| byte);
    close(&view["psnr"], expected, 0.05);
    let background = evaluated(&folder, &["eval", "ns", "data", "--json"]);
    assert_eq!(background["choices"]["background"], "0.149, 0.1647, 0.2157");
    // Lists come before the share.
    let lists = r#""train_filenames": ["images/p00.png"], "test_filenames": ["images/p02.png", "./images/p05.png"],"#;
    write(&folder, "data/transforms.json", &transforms(lists));
    let json = evaluated(&folder, &arguments);
    let names: Vec<&str> =
        json["views"].as_array().expect("views").iter().filter_map(|view| view["name"].as_str()).collect();
    assert_eq!(names, ["p02", "p05"]);
}

/// The map to gsplat's world that its formulas give in numpy for the scene's places and the cameras, row by row.
const GSPLAT_WORLD: [[f64; 4]; 3] = [
    [0.248_024_6, 0.017_916_57, 0.002_390_35, -0.003_629_02],
    [-0.017_858_19, 0.247_975_13, -0.005_686_93, 0.023_589_68],
    [-0.002_793_28, 0.005_500_23, 0.248_605_84, -0.125_755_99],
];

#[gaurast_runner::test]
fn a_folder_of_gsplat_is_measured_in_its_own_world() {
    let folder = inria();
    let place =
        |point: [f64; 3]| GSPLAT_WORLD.map(|[x, y, z, offset]| x * point[0] + y * point[1] + z * point[2] + offset);
    let [x, y, z, _] = GSPLAT_WORLD[0];
    let (model, places) = placed_scene(place, (x * x + y * y + z * z).sqrt());
    write(&folder, "results/ply/point_cloud_29999.ply", &model);
    write(&folder, "results/cfg.yml", "data_dir: data\ndata_factor: 1\ntest_every: 8\nnormalize_world_space: true\n");
    let points = places.iter().enumerate().map(|(at, [x, y, z])| format!("{at} {x} {y} {z} 0 0 0 1\n"));
    write(&folder, "data/sparse/0/points3D.txt", &points.collect::<String>());
    let [width, height] = SIZE;
    let camera = format!("1 PINHOLE {width} {height} 50 50 {} {}\n", width / 2, height / 2);
    write(&folder, "data/sparse/0/cameras.txt", &camera);
    let image = |at: usize| {
        let [x, y, z] = position(at);
        format!("{at} 1 0 0 0 {} {} {} 1 p{at:02}.png\n\n", -x, -y, -z)
    };
    write(&folder, "data/sparse/0/images.txt", &(0..COUNT).map(image).collect::<String>());
    let json = evaluated(&folder, &["eval", "results", "--background", "white", "--values", "8-bit", "--json"]);
    assert!(
        json["choices"]["world"].as_str().is_some_and(|world| world.contains("100.0 % of COLMAP's points")),
        "{json}"
    );
    for (view, name) in json["views"].as_array().expect("views").iter().zip(["p00", "p08", "p16"]) {
        assert_eq!(view["name"], name);
        let [clean, photograph] = [format!("clean/{name}.png"), format!("data/images/{name}.png")];
        // Some bytes are rounded otherwise, since the places are.
        close(&view["psnr"], psnr(&folder, &clean, &photograph, 0, |byte| byte), 0.05);
    }
    std::fs::remove_file(folder.path().join("data/sparse/0/points3D.txt")).expect("removed");
    fails(&folder, &["eval", "results"], "points3D.txt");
}

#[gaurast_runner::test]
fn photographs_of_another_shape_are_refused() {
    let folder = inria();
    let path = Path::new("data/images/p08.png");
    image::RgbImage::new(48, 30).save(folder.path().join(path)).expect("written");
    fails(&folder, &["eval", "out"], "48x30 pixels are not the shape of its camera's picture, 48x36");
}

#[gaurast_runner::test]
fn distorted_photographs_are_compared_with_pictures_of_the_lens() {
    let folder = tempfile::tempdir().expect("a folder");
    write(&folder, "scene.ply", &scene());
    let [width, height] = SIZE;
    write(&folder, "data/sparse/0/cameras.txt", &format!("1 OPENCV {width} {height} 50 50 24 18 -0.3 0.08 0 0\n"));
    let images = (0..2).map(|index| {
        let [x, y, z] = position(index).map(|part| -part);
        format!("{index} 1 0 0 0 {x} {y} {z} 1 p{index:02}.png\n\n")
    });
    write(&folder, "data/sparse/0/images.txt", &images.collect::<String>());
    succeeds(&folder, &["scene.ply", "--cameras", "data", "--view", "all", "-o", "data/images/"]);
    let json = evaluated(&folder, &["eval", "scene.ply", "data", "--split", "all", "--json"]);
    assert_eq!(json["mean"]["equal"], 2, "{json}");
    let lens = "the lens distorts and is drawn so (rational: k1 = -0.3, k2 = 0.08)";
    assert_eq!(json["choices"]["lenses"], lens);
    let json = evaluated(&folder, &["eval", "scene.ply", "data", "--split", "all", "--undistorted", "--json"]);
    assert!(json["views"][0]["psnr"].as_f64().is_some_and(|psnr| psnr < 30.0), "{json}");
    assert!(json["choices"]["lenses"].is_null());
}
