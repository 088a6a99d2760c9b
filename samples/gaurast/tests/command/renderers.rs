//! `gaurast --as`: pictures are those of other renderers, whose formulas are written here again, in binary64, as their code
//! and text have them, without a look at this project's.

use std::path::Path;
use std::process::Command;

use tempfile::TempDir;

const WIDTH: usize = 139;
const HEIGHT: usize = 107;
/// Degrees, the vertical field of view.
const FOV: f64 = 60.0;
const EYE: [f64; 3] = [0.3, -0.2, -4.0];
const COUNT: usize = 1500;
/// Coefficients of red, green and blue of degree 3.
const COEFFICIENTS: usize = 16;

/// A Gaussian as a trained file holds it.
struct Gaussian {
    position: [f32; 3],
    /// Logarithms.
    scale: [f32; 3],
    /// w, x, y, z.
    rotation: [f32; 4],
    /// A logit.
    opacity: f32,
    harmonics: [[f32; 3]; COEFFICIENTS],
}

/// Numbers from 0 to 1 that follow from a seed.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005);
        self.0 = self.0.wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1u64 << 31) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f32 {
        (low + (high - low) * self.next()) as f32
    }
}

/// Gaussians of all sizes, beside the picture, too, and behind the camera; some are needles.
fn scene() -> Vec<Gaussian> {
    let mut random = Random(7);
    let one = |_| {
        let size = random.between(-5.0, -1.0);
        Gaussian {
            position: [random.between(-3.0, 3.0), random.between(-2.5, 2.5), random.between(-4.2, 5.0)],
            scale: [0; 3].map(|_| size + random.between(-1.5, 0.7)),
            rotation: [0; 4].map(|_| random.between(-1.0, 1.0)),
            opacity: random.between(-5.0, 6.0),
            harmonics: [0; COEFFICIENTS].map(|_| [0; 3].map(|_| random.between(-0.4, 0.6))),
        }
    };
    (0..COUNT).map(one).collect()
}

/// The scene as 3DGS writes it: harmonics above degree 0 by channel, then by coefficient.
fn ply(scene: &[Gaussian]) -> Vec<u8> {
    let rest = (0..45).map(|number| format!("f_rest_{number}"));
    let names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2"].map(str::to_owned);
    let others = ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"];
    let others = others.map(str::to_owned);
    let mut header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", scene.len());
    for name in names.into_iter().chain(rest).chain(others) {
        header += &format!("property float {name}\n");
    }
    let mut bytes = (header + "end_header\n").into_bytes();
    for one in scene {
        let mut floats: Vec<f32> = one.position.to_vec();
        floats.extend(one.harmonics[0]);
        for channel in 0..3 {
            floats.extend(one.harmonics[1..].iter().map(|triple| triple[channel]));
        }
        floats.push(one.opacity);
        floats.extend(one.scale);
        floats.extend(one.rotation);
        bytes.extend(floats.into_iter().flat_map(f32::to_le_bytes));
    }
    bytes
}

/// A Gaussian as a renderer projects it.
struct Splat {
    depth: f64,
    distance: f64,
    /// The centre, where pixel centres lie at halves.
    mean: [f64; 2],
    /// xx, xy, yy, the low-pass filter included.
    covariance: [f64; 3],
    opacity: f64,
    color: [f64; 3],
}

/// The rules in which renderers differ.
struct Rules {
    near: f64,
    ceiling: f64,
    compensated: bool,
    /// The least ratio of determinants.
    ratio_floor: f64,
    by_distance: bool,
    /// Reports whether a Gaussian is drawn at the pixel of a column and a row, and whether that is a close call.
    is_within: fn(&Splat, [usize; 2]) -> (bool, bool),
}

/// The projection that 3DGS and gsplat share: EWA, with slopes of at most 1.3 times those of the picture's sides.
fn project(one: &Gaussian, rules: &Rules) -> Option<Splat> {
    let focal = HEIGHT as f64 / 2.0 / (FOV.to_radians() / 2.0).tan();
    let position = one.position.map(f64::from);
    // The camera looks along +z with -y upwards: its axes are the world's.
    let [x, y, z] = [0, 1, 2].map(|axis| position[axis] - EYE[axis]);
    if z <= rules.near {
        return None;
    }
    let tangent = [WIDTH, HEIGHT].map(|side| side as f64 / (2.0 * focal));
    let slope = [x / z, y / z];
    let [tx, ty] = [0, 1].map(|axis| {
        let limit = 1.3 * tangent[axis];
        slope[axis].clamp(-limit, limit) * z
    });
    let jacobian = [[focal / z, 0.0, -focal * tx / (z * z)], [0.0, focal / z, -focal * ty / (z * z)]];
    let [w, qx, qy, qz] = one.rotation.map(f64::from);
    let norm = (w * w + qx * qx + qy * qy + qz * qz).sqrt();
    let [w, qx, qy, qz] = [w, qx, qy, qz].map(|part| part / norm);
    let rotation = [
        [1.0 - 2.0 * (qy * qy + qz * qz), 2.0 * (qx * qy - w * qz), 2.0 * (qx * qz + w * qy)],
        [2.0 * (qx * qy + w * qz), 1.0 - 2.0 * (qx * qx + qz * qz), 2.0 * (qy * qz - w * qx)],
        [2.0 * (qx * qz - w * qy), 2.0 * (qy * qz + w * qx), 1.0 - 2.0 * (qx * qx + qy * qy)],
    ];
    // Files hold binary32, and so are what is made of them.
    let scale = one.scale.map(|scale| f64::from(f64::from(scale).exp() as f32));
    let m: [[f64; 3]; 2] = jacobian.map(|row| {
        [0, 1, 2].map(|column| {
            let turned: f64 = (0..3).map(|axis| row[axis] * rotation[axis][column]).sum();
            turned * scale[column]
        })
    });
    let product = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (xx, xy, yy) = (product(m[0], m[0]), product(m[0], m[1]), product(m[1], m[1]));
    let before = xx * yy - xy * xy;
    let covariance = [xx + 0.3, xy, yy + 0.3];
    let after = covariance[0] * covariance[2] - xy * xy;
    let mut opacity = f64::from((1.0 / (1.0 + (-f64::from(one.opacity)).exp())) as f32);
    if rules.compensated {
        opacity *= (before / after).max(rules.ratio_floor).sqrt();
    }
    let distance = (x * x + y * y + z * z).sqrt();
    Some(Splat {
        depth: z,
        distance,
        mean: [focal * slope[0] + WIDTH as f64 / 2.0, focal * slope[1] + HEIGHT as f64 / 2.0],
        covariance,
        opacity,
        color: color(&one.harmonics, [x / distance, y / distance, z / distance]),
    })
}

/// The colour in a direction, by the real spherical harmonics with the Condon-Shortley phase.
fn color(harmonics: &[[f32; 3]; COEFFICIENTS], [x, y, z]: [f64; 3]) -> [f64; 3] {
    let functions = [
        0.282_094_791_773_878_14,
        -0.488_602_511_902_919_9 * y,
        0.488_602_511_902_919_9 * z,
        -0.488_602_511_902_919_9 * x,
        1.092_548_430_592_079_2 * x * y,
        -1.092_548_430_592_079_2 * y * z,
        0.315_391_565_252_520_05 * (2.0 * z * z - x * x - y * y),
        -1.092_548_430_592_079_2 * x * z,
        0.546_274_215_296_039_6 * (x * x - y * y),
        -0.590_043_589_926_643_5 * y * (3.0 * x * x - y * y),
        2.890_611_442_640_554 * x * y * z,
        -0.457_045_799_464_465_8 * y * (4.0 * z * z - x * x - y * y),
        0.373_176_332_590_115_4 * z * (2.0 * z * z - 3.0 * x * x - 3.0 * y * y),
        -0.457_045_799_464_465_8 * x * (4.0 * z * z - x * x - y * y),
        1.445_305_721_320_277 * z * (x * x - y * y),
        -0.590_043_589_926_643_5 * x * (x * x - 3.0 * y * y),
    ];
    [0, 1, 2].map(|channel| {
        let terms = functions.iter().zip(harmonics);
        let sum: f64 = terms.map(|(function, triple)| function * f64::from(triple[channel])).sum();
        (sum + 0.5).max(0.0)
    })
}

/// The distance from a threshold within which binary32 may decide either way, relative to it.
const CLOSE: f64 = 3e-5;

fn is_close(value: f64, threshold: f64) -> bool {
    (value - threshold).abs() <= CLOSE * threshold.abs().max(1e-9)
}

/// Returns true if a number is so near to a whole one that it could be rounded up to either.
fn is_close_to_whole(value: f64) -> bool {
    (value - value.round()).abs() <= CLOSE
}

/// The tiles of 16 pixels from `low` on to before `high`, and whether the pixel's is among them.
fn is_in_tiles(low: [f64; 2], high: [f64; 2], pixel: [usize; 2]) -> bool {
    (0..2).all(|axis| {
        let tile = (pixel[axis] / 16) as f64;
        low[axis] <= tile && tile < high[axis]
    })
}

/// 3DGS: pixel centres are whole numbers there, and the rectangle is found by truncation.
fn within_square(splat: &Splat, pixel: [usize; 2]) -> (bool, bool) {
    let [xx, xy, yy] = splat.covariance;
    let middle = 0.5 * (xx + yy);
    let determinant = xx * yy - xy * xy;
    let greatest = middle + (middle * middle - determinant).max(0.1).sqrt();
    let radius = 3.0 * greatest.sqrt();
    let point = splat.mean.map(|mean| mean - 0.5);
    let low = point.map(|at| ((at - radius.ceil()) / 16.0).floor());
    let high = point.map(|at| ((at + radius.ceil() + 15.0) / 16.0).floor());
    let ends = point.into_iter().flat_map(|at| {
        let radius = radius.ceil();
        [(at - radius) / 16.0, (at + radius + 15.0) / 16.0]
    });
    let is_close = is_close_to_whole(radius) || ends.into_iter().any(is_close_to_whole);
    (is_in_tiles(low, high, pixel), is_close)
}

/// gsplat: a radius for each axis, and for each Gaussian the deviations after which its alpha is below the threshold.
fn within_rectangle(splat: &Splat, pixel: [usize; 2]) -> (bool, bool) {
    let [xx, _, yy] = splat.covariance;
    let deviations = 3.33_f64.min((2.0 * (splat.opacity * 255.0).ln()).max(0.0).sqrt());
    let radii = [xx, yy].map(|variance| deviations * variance.sqrt());
    let side = |axis: usize, sign: f64| (splat.mean[axis] + sign * radii[axis].ceil()) / 16.0;
    let low = [0, 1].map(|axis| side(axis, -1.0).floor());
    let high = [0, 1].map(|axis| side(axis, 1.0).ceil());
    let mut ends = (0..2).flat_map(|axis| [side(axis, -1.0), side(axis, 1.0)]);
    let is_close = radii.into_iter().any(is_close_to_whole) || ends.any(is_close_to_whole);
    (is_in_tiles(low, high, pixel), is_close)
}

/// `KHR_gaussian_splatting`: a Mahalanobis distance of 3.
fn within_ellipse(splat: &Splat, pixel: [usize; 2]) -> (bool, bool) {
    let q = square(splat, pixel);
    (q <= 9.0, is_close(q, 9.0))
}

/// The square of the Mahalanobis distance of a pixel's centre.
fn square(splat: &Splat, pixel: [usize; 2]) -> f64 {
    let [dx, dy] = [0, 1].map(|axis| pixel[axis] as f64 + 0.5 - splat.mean[axis]);
    let [xx, xy, yy] = splat.covariance;
    let determinant = xx * yy - xy * xy;
    (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / determinant
}

/// A pixel, and whether a close call came before it was finished.
fn composite(splats: &[Splat], rules: &Rules, pixel: [usize; 2]) -> ([f64; 4], bool) {
    let (mut sum, mut transmittance, mut is_open) = ([0.0; 3], 1.0, false);
    for splat in splats {
        let alpha = splat.opacity * (-0.5 * square(splat, pixel)).exp();
        if alpha < (1.0 - CLOSE) / 255.0 {
            continue;
        }
        let (is_within, is_close_call) = (rules.is_within)(splat, pixel);
        is_open |= is_close_call || is_within && is_close(alpha, 1.0 / 255.0);
        if !is_within || alpha < 1.0 / 255.0 {
            continue;
        }
        let alpha = alpha.min(rules.ceiling);
        let rest = transmittance * (1.0 - alpha);
        is_open |= is_close(rest, 1e-4);
        if rest < 1e-4 {
            break;
        }
        for (sum, color) in sum.iter_mut().zip(splat.color) {
            *sum += transmittance * alpha * color;
        }
        transmittance = rest;
    }
    let [r, g, b] = sum;
    ([r, g, b, 1.0 - transmittance], is_open)
}

/// The command's picture: (C, 1 - T).
fn drawn(folder: &TempDir, arguments: &[&str]) -> Vec<[f32; 4]> {
    let size = format!("{WIDTH}x{HEIGHT}");
    let eye = EYE.map(|c| c.to_string()).join(",");
    let target = [EYE[0], EYE[1], EYE[2] + 1.0].map(|c| c.to_string()).join(",");
    let (eye, target) = (format!("--eye={eye}"), format!("--target={target}"));
    let fov = FOV.to_string();
    let output = Command::new(env!("CARGO_BIN_EXE_gaurast"))
        .args(["scene.ply", &eye, &target, "--fov", &fov, "--size", &size])
        .args(["--force", "-q", "-o", "a.exr"])
        .args(arguments)
        .current_dir(folder.path())
        .output()
        .expect("the command starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {stderr}");
    pixels(&folder.path().join("a.exr"))
}

fn pixels(path: &Path) -> Vec<[f32; 4]> {
    let picture = image::open(path).expect("a picture").into_rgba32f();
    picture.pixels().map(|pixel| pixel.0).collect()
}

/// Holds the command's picture against a renderer's; returns how many pixels were too close to call.
#[track_caller]
fn check(folder: &TempDir, arguments: &[&str], rules: &Rules) -> usize {
    let mut splats: Vec<Splat> = scene().iter().filter_map(|one| project(one, rules)).collect();
    splats.sort_by(|a, b| {
        let key = |splat: &Splat| {
            if rules.by_distance { splat.distance } else { splat.depth }
        };
        (key(a) as f32).total_cmp(&(key(b) as f32))
    });
    let picture = drawn(folder, arguments);
    assert_eq!(picture.len(), WIDTH * HEIGHT);
    let (mut open, mut different, mut covered) = (0, Vec::new(), 0);
    for (at, pixel) in picture.iter().enumerate() {
        let place = [at % WIDTH, at / WIDTH];
        let (expected, is_open) = composite(&splats, rules, place);
        covered += usize::from(expected[3] > 0.5);
        let apart = (0..4).map(|channel| (expected[channel] - f64::from(pixel[channel])).abs()).fold(0.0, f64::max);
        if apart > 1e-5 {
            if is_open {
                open += 1;
            } else {
                different.push((place, expected, *pixel));
            }
        }
    }
    assert!(covered > WIDTH * HEIGHT / 2, "{covered} pixels are covered");
    assert!(different.is_empty(), "{arguments:?}: {} pixels differ, such as {:?}", different.len(), different[0]);
    open
}

fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("scene.ply"), ply(&scene())).expect("written");
    folder
}

/// Few pixels are too close to call: of 14,873.
const FEW: usize = 20;

#[gaurast_runner::test]
fn inria_s_pictures_are_drawn() {
    let folder = folder();
    let rules = Rules {
        near: f64::from(0.2_f32),
        ceiling: 0.99,
        compensated: false,
        ratio_floor: 0.0,
        by_distance: false,
        is_within: within_square,
    };
    let open = check(&folder, &["--as", "inria"], &rules);
    assert!(open <= FEW, "{open}");
    let compensated = Rules { compensated: true, ratio_floor: 0.000_025, ..rules };
    let arguments = ["--as", "inria", "--antialiasing", "compensated"];
    let open = check(&folder, &arguments, &compensated);
    assert!(open <= FEW, "{open}");
}

#[gaurast_runner::test]
fn gsplat_s_pictures_are_drawn() {
    let folder = folder();
    let rules = Rules {
        near: 0.01,
        ceiling: 0.99,
        compensated: false,
        ratio_floor: 0.0,
        by_distance: false,
        is_within: within_rectangle,
    };
    let open = check(&folder, &["--as", "gsplat"], &rules);
    assert!(open <= FEW, "{open}");
    let older = Rules { ceiling: 0.999, ..rules };
    let open = check(&folder, &["--as", "gsplat-1.5"], &older);
    assert!(open <= FEW, "{open}");
    // gsplat 1.6: `MIN_COMPENSATION` is the root of the ratio.
    let compensated = Rules { compensated: true, ratio_floor: 0.005 * 0.005, ..rules };
    let arguments = ["--as", "gsplat", "--antialiasing", "compensated"];
    let open = check(&folder, &arguments, &compensated);
    assert!(open <= FEW, "{open}");
    let older = Rules { ratio_floor: 0.0, ceiling: 0.999, ..compensated };
    let arguments = ["--as", "gsplat-1.5", "--antialiasing", "compensated"];
    let open = check(&folder, &arguments, &older);
    assert!(open <= FEW, "{open}");
}

#[gaurast_runner::test]
fn pictures_of_gltf_s_extension_are_drawn() {
    let folder = folder();
    let rules = Rules {
        near: f64::from(0.3_f32),
        ceiling: 0.99,
        compensated: false,
        ratio_floor: 0.0,
        by_distance: true,
        is_within: within_ellipse,
    };
    let open = check(&folder, &["--as", "gltf", "--near", "0.3"], &rules);
    assert!(open <= FEW, "{open}");
}

#[gaurast_runner::test]
fn renderers_differ_and_pictures_are_compared_with_them() {
    let folder = folder();
    let plain = drawn(&folder, &["--near", "0.3"]);
    let mut pictures = vec![plain];
    for renderer in ["inria", "gsplat", "gsplat-1.5", "gsplat-unscented", "usd", "gltf"] {
        pictures.push(drawn(&folder, &["--as", renderer]));
    }
    for (index, picture) in pictures.iter().enumerate() {
        for other in &pictures[..index] {
            assert!(picture != other, "{index}");
        }
    }
    // The last one is there still.
    let eye = EYE.map(|c| c.to_string()).join(",");
    let target = [EYE[0], EYE[1], EYE[2] + 1.0].map(|c| c.to_string()).join(",");
    let (eye, target) = (format!("--eye={eye}"), format!("--target={target}"));
    let fov = FOV.to_string();
    let compared = |renderer: &str| {
        let output = Command::new(env!("CARGO_BIN_EXE_gaurast"))
            .args(["compare", "a.exr", "scene.ply", &eye, &target, "--fov", &fov])
            .args(["--as", renderer, "--fail-below", "90"])
            .current_dir(folder.path())
            .output()
            .expect("the command starts");
        output.status.code()
    };
    assert_eq!(compared("gltf"), Some(0));
    assert_eq!(compared("inria"), Some(1));
    let refused = Command::new(env!("CARGO_BIN_EXE_gaurast"))
        .args(["scene.ply", "--as", "inria", "--geometry", "2d", "-o", "b.png"])
        .current_dir(folder.path())
        .output()
        .expect("the command starts");
    assert_eq!(refused.status.code(), Some(1));
    let stderr = String::from_utf8_lossy(&refused.stderr);
    assert!(stderr.contains("cut-offs"), "{stderr}");
}
