//! USD files with Gaussians, of OpenUSD's own writer: `usd/make.py` makes them.

use gaurast_runner::data;
use gaurast_scene::{Axes, Geometry, Options, Reason, Scene, SortOrder};

use super::support::*;

const FLOATS: [&[u8]; 2] = [include_bytes!("usd/floats.usda"), include_bytes!("usd/floats.usdc")];
const HALVES: [&[u8]; 2] = [include_bytes!("usd/halves.usda"), include_bytes!("usd/halves.usdc")];
const STAGE: [&[u8]; 2] = [include_bytes!("usd/stage.usda"), include_bytes!("usd/stage.usdc")];
const SURFLETS: [&[u8]; 2] = [include_bytes!("usd/surflets.usda"), include_bytes!("usd/surflets.usdc")];
const COMPOSED: &[u8] = include_bytes!("usd/composed/root.usdc");
const OLD: &[u8] = include_bytes!("usd/old.usdc");
const PACKAGE: &[u8] = include_bytes!("usd/package.usdz");

/// Gaussians of a file of `make.py`.
const COUNT: usize = 40;

/// Reads `file` with the axes of scenes, so that its numbers are kept.
fn unturned(name: &str, file: &[u8]) -> Scene {
    let options = Options { axes: Some(Axes::RIGHT_DOWN_FRONT), ..Options::default() };
    let path = std::path::Path::new(name);
    gaurast_scene::read_with(path, &mut &file[..], file.len() as u64, &options).expect("a good file")
}

fn names(files: [&'static [u8]; 2]) -> [(&'static str, &'static [u8]); 2] {
    [("a.usda", files[0]), ("a.usdc", files[1])]
}

#[gaurast_runner::test]
fn both_encodings_and_precisions_have_the_written_values() {
    let files = names(FLOATS).into_iter().chain(names(HALVES));
    for (name, file) in files.chain([("a.usdc", OLD), ("a.usdz", PACKAGE), ("a.usd", FLOATS[0]), ("a.usd", FLOATS[1])])
    {
        let scene = unturned(name, file);
        assert_eq!((scene.len(), scene.sh_degree()), (COUNT, 1), "{name}");
        for i in 0..COUNT {
            let row = i as f32;
            assert_eq!(scene.positions()[i], [0.25 * row, -0.5 * row, 1.0 + 0.125 * row], "{name}");
            let shape = scene.shapes()[i];
            assert_eq!(shape.rotation, [1.0, 0.5, -0.25, 0.125 * (i % 5) as f32], "{name}");
            assert_eq!(shape.scale, [0.5, 0.25, 0.125 * (1 + i % 3) as f32], "{name}");
            assert_eq!(shape.opacity, 0.25 * (1 + i % 4) as f32, "{name}");
            for (k, coefficient) in scene.sh()[4 * i..4 * i + 4].iter().enumerate() {
                let k = k as f32;
                assert_eq!(*coefficient, [0.5 * k, -0.25 * k, 0.0625 * (i % 16) as f32], "{name}");
            }
        }
    }
}

/// The values that OpenUSD computes of a stage.
#[derive(serde::Deserialize)]
struct Expected {
    positions: Vec<[f64; 3]>,
    volumes: Vec<f64>,
}

impl Expected {
    /// Checks that `scene` has these Gaussians, in the order of their positions.
    #[track_caller]
    fn check(&self, name: &str, scene: &Scene) {
        assert_eq!(scene.len(), self.positions.len(), "{name}");
        let gaussian = |position: [f64; 3], volume: f64| [position[0], position[1], position[2], volume];
        let mut expected: Vec<[f64; 4]> =
            self.positions.iter().zip(&self.volumes).map(|(position, volume)| gaussian(*position, *volume)).collect();
        let volume = |scale: [f32; 3]| scale.iter().map(|scale| f64::from(*scale)).product();
        let mut found: Vec<[f64; 4]> = (scene.positions().iter().zip(scene.shapes()))
            .map(|(position, shape)| gaussian(position.map(f64::from), volume(shape.scale)))
            .collect();
        // Rounding does not change the order of positions that differ.
        let key = |gaussian: &[f64; 4]| gaussian.map(|value| (value * 1e3).round() as i64);
        expected.sort_by_key(key);
        found.sort_by_key(key);
        for (found, expected) in found.iter().zip(&expected) {
            close(&found.map(|value| value as f32), &expected.map(|value| value as f32), 1e-4);
        }
    }
}

#[gaurast_runner::test]
fn layers_are_composed_as_openusd_composes_them() {
    let expected: Expected = serde_json::from_str(include_str!("usd/composed/root.json")).expect("the script's file");
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats/usd/composed");
    let options = Options { axes: Some(Axes::RIGHT_DOWN_FRONT), ..Options::default() };
    for name in ["root.usda", "root.usdc"] {
        let scene = gaurast_scene::open_with(&folder.join(name), &options, |file, _| file).expect("a good file");
        expected.check(name, &scene);
        assert_eq!(scene.metadata().warnings, [""; 0], "{name}");
    }
    // A part that is not there is named, and the others are read.
    let alone = tempfile::tempdir().expect("a folder");
    let copy = alone.path().join("root.usda");
    std::fs::copy(folder.join("root.usda"), &copy).expect("copied");
    std::fs::copy(folder.join("part.usdc"), alone.path().join("part.usdc")).expect("copied");
    let scene = gaurast_scene::open(&copy).expect("a good file");
    let warnings = scene.metadata().warnings.join("\n");
    for part in [
        "prim /world/group is incomplete: nested/group.usda: ",
        "prim /world/second is incomplete: package.usdz: ",
        "sublayer below.usda is not composed: ",
    ] {
        assert!(warnings.contains(part), "{part:?} is not told: {warnings}");
    }
}

#[gaurast_runner::test]
fn layers_that_compose_themselves_are_refused_or_named() {
    let splat = "def ParticleField3DGaussianSplat \"s\" { point3f[] positions = [(1, 2, 3)]\n float3[] scales = [(1, 1, 1)]\n \
         quatf[] orientations = [(1, 0, 0, 0)]\n float[] opacities = [1] }\n";
    let itself = format!("#usda 1.0\n{splat} def \"a\" (references = </a>) {{ }}\n");
    let (_, reason) = refusal("a.usda", itself.as_bytes());
    assert!(reason.to_string().contains("composed of too many prims, or of itself"), "{reason}");
    let mut doubling = format!("#usda 1.0\n{splat} def \"p0\" {{ {splat} }}\n");
    for i in 1..40 {
        let below = i - 1;
        doubling += &format!(
            "def \"p{i}\" {{ def \"a\" (references = </p{below}>) {{ }} def \"b\" (references = </p{below}>) {{ }} }}\n"
        );
    }
    let (_, reason) = refusal("a.usda", doubling.as_bytes());
    assert!(reason.to_string().contains("composed of too many prims"), "{reason}");
    for (arc, told) in [
        ("references = @../b.usda@", "../b.usda: "),
        ("references = </none>", "there is no /none in its own layer"),
        ("payload = @/etc/b.usda@</b>", "/etc/b.usda: "),
    ] {
        let file = format!("#usda 1.0\n{splat} def \"a\" ({arc}) {{ }}\n");
        let scene = read("a.usda", file.as_bytes()).expect("a good file");
        let warnings = scene.metadata().warnings.join("\n");
        assert!(warnings.contains(told) && warnings.contains("prim /a is incomplete"), "{arc}: {warnings}");
    }
}

#[gaurast_runner::test]
fn surflets_are_flat_gaussians() {
    for (name, file) in names(SURFLETS) {
        let scene = unturned(name, file);
        assert_eq!((scene.len(), scene.geometry()), (COUNT, Geometry::Surfel), "{name}");
        assert_eq!(scene.shapes()[0].scale, [0.5, 0.25, 0.0], "{name}");
    }
    let [text, _] = SURFLETS;
    let text = std::str::from_utf8(text).expect("text");
    let ellipsoids = text.replace("KernelGaussianSurfletAPI", "KernelGaussianEllipsoidAPI");
    assert_eq!(unturned("a.usda", ellipsoids.as_bytes()).geometry(), Geometry::Volume);
    let constant = text.replace("KernelGaussianSurfletAPI", "KernelConstantSurfletAPI");
    let (_, reason) = refusal("a.usda", constant.as_bytes());
    assert!(reason.to_string().contains("no prim that is drawn"), "{reason}");
}

#[gaurast_runner::test]
fn transforms_are_those_that_openusd_computes() {
    let expected: Expected = serde_json::from_str(include_str!("usd/stage.json")).expect("the script's file");
    for (name, file) in names(STAGE) {
        let scene = unturned(name, file);
        expected.check(name, &scene);
        // The first value of those that vary with time is that of three Gaussians.
        assert_eq!(scene.shapes().iter().filter(|shape| shape.opacity == 0.5).count(), 6);
        // The parts differ in the order of sorting.
        assert_eq!(scene.metadata().order, None);
        let told: Vec<&str> =
            scene.metadata().warnings.iter().chain(&scene.metadata().notes).map(String::as_str).collect();
        let told = told.join("\n");
        for part in ["ignored: 4", "1 Cube, 1 Mesh", "vary with time", "a unit is 0.01 m"] {
            assert!(told.contains(part), "{name}: {part:?} is not told: {told}");
        }
    }
}

#[gaurast_runner::test]
fn axes_are_those_of_the_file_unless_its_writer_keeps_those_of_ply() {
    let [text, _] = FLOATS;
    let text = std::str::from_utf8(text).expect("text");
    let second = |text: &str| read("a.usda", text.as_bytes()).expect("a good file").positions()[1];
    assert_eq!(second(text), [0.25, 0.5, -1.125], "y is upwards");
    assert_eq!(second(&text.replace("upAxis = \"Y\"", "upAxis = \"Z\"")), [0.25, -1.125, -0.5], "z is upwards");
    let converted =
        text.replacen('(', "(\n    \"\"\"Converted from PLY/SPZ to USD using usd-convert-gsplat\"\"\"\n", 1);
    assert_eq!(second(&converted), [0.25, -0.5, 1.125]);
    let (_, reason) = refusal("a.usda", text.replace("upAxis = \"Y\"", "upAxis = \"W\"").as_bytes());
    assert!(reason.to_string().contains("neither Y nor Z"));
}

#[gaurast_runner::test]
fn hints_and_colours_are_taken() {
    let prim = |body: &str| {
        format!(
            "#usda 1.0\ndef ParticleField3DGaussianSplat \"a\" {{ point3f[] positions = [(1, 2, 3)]; float3[] scales = \
             [(1, 1, 1)]\n quatf[] orientations = [(1, 0, 0, 0)]\n float[] opacities = [1] # a comment\n {body}\n}}\n"
        )
    };
    for (hint, order) in [
        ("zDepth", Some(SortOrder::Depth)),
        ("cameraDistance", Some(SortOrder::Distance)),
        ("rayHitDistance", Some(SortOrder::PerPixel)),
        ("another", None),
    ] {
        let file = prim(&format!("uniform token sortingModeHint = \"{hint}\""));
        assert_eq!(read("a.usda", file.as_bytes()).expect("a good file").metadata().order, order, "{hint}");
    }
    let colored = prim("color3f[] primvars:displayColor = [(1, 0.5, 0)] (\n interpolation = \"constant\"\n)");
    let scene = read("a.usda", colored.as_bytes()).expect("a good file");
    close(&scene.sh()[0].map(|c| 0.5 + SH_C0 * c), &[1.0, 0.5, 0.0], 1e-6);
}

#[gaurast_runner::test]
fn malformed_files_are_refused_with_their_place() {
    let [text, binary] = FLOATS;
    let text = std::str::from_utf8(text).expect("text");
    for (from, to, place, reason) in [
        ("float[] opacities = [0.25,", "float[] opacities = [", "prim /splat, opacities", "it holds 39 entries"),
        ("float[] opacities = [0.25,", "float[] other = [", "prim /splat, opacities", "it is missing"),
        ("point3f[] positions = [(0, -0, 1)", "point3f[] positions = [(0, 1)", "line", "has 3 numbers"),
        ("float[] opacities = [0.25", "float[] opacities = [0.2x5", "line", "\"0.2x5\" is not a number"),
        ("Degree = 1", "Degree = 9", "prim /splat, radiance:sphericalHarmonicsDegree", "degree 9 exceeds 4"),
        ("def ParticleField3DGaussianSplat", "def Points", "the file", "no prim that is drawn"),
        ("upAxis = \"Y\"", "upAxis = \"Y", "line 3", "does not end"),
    ] {
        assert!(text.contains(from), "{from}");
        let error = read("a.usda", text.replacen(from, to, 1).as_bytes()).expect_err(to).to_string();
        assert!(error.contains(place) && error.contains(reason), "{to}: {error}");
    }
    assert!(matches!(refusal("a.usdc", b"PXR-USDC\0\x63\0\0\0\0\0\0\0\0\0\0").1, Reason::Version { found: 99, .. }));
    assert!(matches!(refusal("a.usd", b"neither").1, Reason::Magic { .. }));
    // Cut anywhere, or with any byte changed, a file is read or refused.
    for binary in [binary, COMPOSED] {
        for len in 0..binary.len() {
            let _ = read("a.usdc", &binary[..len]);
            let mut damaged = binary.to_vec();
            damaged[len] ^= 1 << (len % 8);
            let _ = read("a.usdc", &damaged);
        }
    }
    for len in 0..text.len() {
        let _ = read("a.usda", &text.as_bytes()[..len]);
    }
    let deep = format!("#usda 1.0\n{}", "def \"a\" { ".repeat(100_000));
    assert!(refusal("a.usda", deep.as_bytes()).1.to_string().contains("nested too deeply"));
    let brackets = format!("#usda 1.0\ndef \"a\" {{ float a = {}", "(".repeat(1_000_000));
    assert!(read("a.usda", brackets.as_bytes()).is_err());
}

#[gaurast_runner::test(needs = [gaurast_runner::Need::Data("faults/base.usdc")])]
fn a_converted_file_is_its_source() {
    let open = |name: &'static str| gaurast_scene::open(data(name)).expect("a good file");
    let source = open("faults/base.ply");
    for name in ["faults/base.usdc", "faults/base.usdz"] {
        let scene = open(name);
        assert_eq!(scene.positions(), source.positions(), "{name}");
        close(scene.sh().as_flattened(), source.sh().as_flattened(), 1e-6);
        for (found, expected) in scene.shapes().iter().zip(source.shapes()) {
            close(&found.scale, &expected.scale, 1e-6);
            close(&[found.opacity], &[expected.opacity], 1e-6);
            close(&found.rotation, &expected.rotation, 1e-6);
        }
    }
}
