//! Draws a picture of each mode of Gaussian draws, in plain `ash`, and writes the page that shows them:
//! `gallery [FOLDER]` writes FOLDER/GALLERY.md and FOLDER/pictures/gallery/*.png; FOLDER is `samples` by default.

mod gpu;
mod scenes;

use std::error::Error;
use std::fmt::Write;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use ash::vk::SampleCountFlags as Samples;
use gaurast::vk::{
    GaussianAntialiasingGAURAST as Antialiasing, GaussianCameraGAURAST as Camera,
    GaussianCameraModelGAURAST as Model, GaussianGeometryGAURAST as Geometry,
    GaussianLinearizationGAURAST as Linearization, GaussianOrderGAURAST as Order,
    GaussianPrecisionGAURAST as Precision, PipelineGaussianStateCreateInfoGAURAST as State,
};
use gpu::{Gpu, Picture, Triangle};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};

const SIZE: [u32; 2] = [192, 120];

/// A picture with its file's name and what is said about it.
struct Exhibit<'a> {
    name: &'a str,
    caption: &'a str,
    picture: Picture<'a>,
}

/// Pictures that belong together.
struct Room<'a> {
    title: &'a str,
    text: &'a str,
    exhibits: Vec<Exhibit<'a>>,
}

/// Looks along +z from the origin, with a focal length in pixels.
fn camera(focal: f32) -> Camera<'static> {
    let [width, height] = SIZE.map(|side| side as f32);
    Camera::default()
        .focal_length([focal; 2])
        .principal_point([width / 2.0, height / 2.0])
        .depth_range(0.2, 100.0)
        .expect("planes in front of the camera")
}

fn exhibit<'a>(name: &'a str, caption: &'a str, splats: &'a [gpu::Splat]) -> Exhibit<'a> {
    Exhibit {
        name,
        caption,
        picture: Picture {
            size: SIZE,
            camera: camera(150.0),
            state: State::default(),
            splats,
            instances: &[],
            triangle: None,
            samples: Samples::TYPE_1,
        },
    }
}

impl Exhibit<'_> {
    fn state(mut self, change: impl FnOnce(State<'static>) -> State<'static>) -> Self {
        self.picture.state = change(self.picture.state);
        self
    }

    fn camera(mut self, camera: Camera<'static>) -> Self {
        self.picture.camera = camera;
        self
    }
}

/// A triangle across the picture, half as deep as the still life.
fn triangle() -> Option<Triangle> {
    let [c0, c1] = camera(1.0).depth_coefficients;
    Some(Triangle {
        corners: [
            [-0.9, 0.85, 0.75, 0.7, 0.6],
            [0.1, -0.95, 0.9, 0.85, 0.75],
            [0.85, 0.7, 0.6, 0.55, 0.5],
        ],
        depth: c0 + c1 / scenes::MIDDLE,
    })
}

fn orders<'a>(crossing: &'a [gpu::Splat]) -> Room<'a> {
    let one = |name, caption, order| {
        exhibit(name, caption, crossing)
            .camera(camera(60.0))
            .state(|state| state.order(order))
    };
    Room {
        title: "Orders",
        text: "The same Gaussians, front to back by depth along the view, by distance from the eye, as they are drawn, and at \
               each pixel by where they are greatest along its ray.",
        exhibits: vec![
            one("order-view-depth", "`VIEW_DEPTH`", Order::VIEW_DEPTH),
            one(
                "order-distance",
                "`RADIAL_DISTANCE`",
                Order::RADIAL_DISTANCE,
            ),
            one("order-primitive", "`PRIMITIVE`", Order::PRIMITIVE),
            one("order-per-pixel", "`PER_PIXEL`", Order::PER_PIXEL),
        ],
    }
}

fn rasterization<'a>(crossing: &'a [gpu::Splat]) -> Room<'a> {
    let one = |name, caption, change: fn(State<'static>) -> State<'static>| {
        exhibit(name, caption, crossing)
            .camera(camera(60.0))
            .state(change)
    };
    Room {
        title: "Geometry and precision",
        text: "The same again as volumes, as discs that rays meet exactly, and in binary16.",
        exhibits: vec![
            one("volumes", "`GAUSSIAN_3D`", |state| state),
            one("discs", "`GAUSSIAN_2D`", |state| {
                state.geometry(Geometry::GAUSSIAN_2D)
            }),
            one("binary16", "`FLOAT16`", |state| {
                state.precision(Precision::FLOAT16)
            }),
        ],
    }
}

fn antialiasing<'a>(needles: &'a [gpu::Splat]) -> Room<'a> {
    let one = |name, caption, mode| {
        exhibit(name, caption, needles).state(|state| state.antialiasing(mode))
    };
    Room {
        title: "Anti-aliasing",
        text: "Needles thinner than a pixel, more so to the right. A filter widens all of them; compensation makes them \
               fainter by as much.",
        exhibits: vec![
            one("dilated", "`DILATE`", Antialiasing::DILATE),
            one(
                "compensated",
                "`OPACITY_COMPENSATED`",
                Antialiasing::OPACITY_COMPENSATED,
            ),
        ],
    }
}

fn cameras<'a>(around: &'a [gpu::Splat]) -> Room<'a> {
    let [width, height] = SIZE.map(|side| side as f32);
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let panorama = Camera::panorama(&axes, [0.0; 3], [width, height]).expect("a camera");
    let model = |model, focal| camera(focal).model(model);
    Room {
        title: "Cameras",
        text: "Gaussians on a sphere about the eye, of a hue for each longitude, the horizon white.",
        exhibits: vec![
            exhibit("pinhole", "`PINHOLE`", around).camera(camera(80.0)),
            exhibit("orthographic", "`ORTHOGRAPHIC`", around)
                .camera(model(Model::ORTHOGRAPHIC, 28.0)),
            exhibit("fisheye", "`FISHEYE`, 280 degrees wide", around)
                .camera(model(Model::FISHEYE, 41.0)),
            exhibit("panorama", "`EQUIRECTANGULAR`", around).camera(panorama),
        ],
    }
}

fn projections<'a>(wide: &'a [gpu::Splat]) -> Room<'a> {
    let one = |name, caption, way| {
        exhibit(name, caption, wide)
            .camera(camera(38.0))
            .state(|state| state.linearization(way))
    };
    Room {
        title: "Projection",
        text: "Gaussians that point away from the eye, in a field 137 degrees wide. The Jacobian knows how their middles move; the \
               unscented transform knows their ends, too.",
        exhibits: vec![
            one("jacobian", "`JACOBIAN`", Linearization::JACOBIAN),
            one("unscented", "`UNSCENTED`", Linearization::UNSCENTED),
        ],
    }
}

fn triangles<'a>(still: &'a [gpu::Splat]) -> Room<'a> {
    let one = |name, caption, samples| {
        let mut one = exhibit(name, caption, still);
        one.picture.triangle = triangle();
        one.picture.samples = samples;
        one
    };
    Room {
        title: "Depth and samples",
        text: "Gaussians in front of a triangle and behind it, which share its depth buffer.",
        exhibits: vec![
            exhibit("still-life", "no triangle", still),
            one("depth", "one sample", Samples::TYPE_1),
            one("multisampled", "four samples", Samples::TYPE_4),
        ],
    }
}

fn instances<'a>(flower: &'a [gpu::Splat], meadow: &'a [gpu::Instance]) -> Room<'a> {
    let mut many = exhibit("instances", "60 of them in one draw", flower);
    many.picture.instances = meadow;
    Room {
        title: "Instances",
        text: "One model, placed by a matrix for each instance and sorted together; the last rows fade.",
        exhibits: vec![
            exhibit("model", "the model", flower).camera(camera(280.0)),
            many,
        ],
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).unwrap_or("samples".to_owned());
    let folder = Path::new(&folder);
    let pictures = folder.join("pictures/gallery");
    std::fs::create_dir_all(&pictures)?;
    let (crossing, needles) = (scenes::crossing(), scenes::needles());
    let (around, wide, still) = (scenes::around(), scenes::wide(), scenes::still_life());
    let (flower, meadow) = (scenes::flower(), scenes::meadow());
    let rooms = [
        cameras(&around),
        projections(&wide),
        orders(&crossing),
        rasterization(&crossing),
        antialiasing(&needles),
        triangles(&still),
        instances(&flower, &meadow),
    ];
    let gpu = Gpu::new()?;
    let mut page = "# Gallery\n\nA picture of each mode; `cargo run --release --example gallery` draws them again.\n".to_owned();
    for room in rooms {
        let (mut images, mut captions) = (String::new(), String::new());
        for Exhibit {
            name,
            caption,
            picture,
        } in &room.exhibits
        {
            let file = BufWriter::new(File::create(pictures.join(format!("{name}.png")))?);
            let encoder =
                PngEncoder::new_with_quality(file, CompressionType::Best, FilterType::Adaptive);
            gpu.draw(picture)?.write_with_encoder(encoder)?;
            write!(images, "| ![{name}](pictures/gallery/{name}.png) ")?;
            write!(captions, "| {caption} ")?;
        }
        let rule = "|---".repeat(room.exhibits.len());
        let (title, text) = (room.title, room.text);
        write!(
            page,
            "\n## {title}\n\n{text}\n\n{images}|\n{rule}|\n{captions}|\n"
        )?;
    }
    std::fs::write(folder.join("GALLERY.md"), page)?;
    Ok(())
}
