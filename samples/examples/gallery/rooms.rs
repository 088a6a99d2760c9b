//! The contents of the gallery's page: rooms of pictures that are compared.

use ash::vk::SampleCountFlags as Samples;
use gaurast::vk::{
    GaussianAntialiasingGAURAST as Antialiasing, GaussianCameraGAURAST as Camera, GaussianCameraModelGAURAST as Model,
    GaussianGeometryGAURAST as Geometry, GaussianLinearizationGAURAST as Linearization, GaussianOrderGAURAST as Order,
    GaussianPrecisionGAURAST as Precision, PipelineGaussianStateCreateInfoGAURAST as State,
};

use crate::gpu::{Picture, Resolve, Splat, Triangle};
use crate::scenes::{self, Scenes};

const SIZE: [u32; 2] = [192, 120];

/// The contents of a picture.
#[allow(clippy::large_enum_variant, reason = "there are some thirty of them")]
pub enum Content<'a> {
    Drawn(Picture<'a>),
    /// The difference of the second picture from the first, multiplied by the number.
    Difference([Picture<'a>; 2], f32),
}

/// A picture with its file's name and its caption.
pub struct Exhibit<'a> {
    pub name: &'a str,
    pub caption: &'a str,
    pub content: Content<'a>,
}

/// Pictures that belong together.
pub struct Room<'a> {
    pub title: &'a str,
    pub text: &'a str,
    pub exhibits: Vec<Exhibit<'a>>,
}

/// All rooms.
pub fn all(scenes: &Scenes) -> Vec<Room<'_>> {
    vec![
        cameras(scenes),
        projections(scenes),
        shaders(scenes),
        orders(scenes),
        merged(scenes),
        geometry(scenes),
        precision(scenes),
        antialiasing(scenes),
        limits(scenes),
        triangles(scenes),
        instances(scenes),
    ]
}

/// A camera at the origin that looks along +z, with a focal length in pixels.
fn camera(focal: f32) -> Camera<'static> {
    let [width, height] = SIZE.map(|side| side as f32);
    Camera::default()
        .focal_length([focal; 2])
        .principal_point([width / 2.0, height / 2.0])
        .depth_range(0.2, 100.0)
        .expect("planes in front of the camera")
}

fn picture(splats: &[Splat], focal: f32) -> Picture<'_> {
    Picture {
        size: SIZE,
        camera: camera(focal),
        state: State::default(),
        splats,
        instances: &[],
        triangle: None,
        samples: Samples::TYPE_1,
        draws: &[],
        share_a_set: false,
        by_shader: false,
        resolve: None,
        coverage: false,
    }
}

/// A picture with another state.
fn with<'a>(picture: Picture<'a>, change: impl FnOnce(State<'static>) -> State<'static>) -> Picture<'a> {
    Picture { state: change(picture.state), ..picture }
}

fn drawn<'a>(name: &'a str, caption: &'a str, picture: Picture<'a>) -> Exhibit<'a> {
    Exhibit { name, caption, content: Content::Drawn(picture) }
}

fn difference<'a>(name: &'a str, caption: &'a str, pictures: [Picture<'a>; 2], times: f32) -> Exhibit<'a> {
    Exhibit { name, caption, content: Content::Difference(pictures, times) }
}

fn cameras(scenes: &Scenes) -> Room<'_> {
    let [width, height] = SIZE.map(|side| side as f32);
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let panorama = Camera::panorama(&axes, [0.0; 3], [width, height]).expect("a camera");
    let by = |camera| Picture { camera, ..picture(&scenes.around, 1.0) };
    let aside = camera(80.0).principal_point([0.2 * width, 0.8 * height]);
    Room {
        title: "Cameras",
        text: "Gaussians on a sphere around the eye. Each longitude has its own hue, and the horizon is white.",
        exhibits: vec![
            drawn("pinhole", "`PINHOLE`", by(camera(80.0))),
            drawn("off-centre", "`PINHOLE`, another principal point", by(aside)),
            drawn("orthographic", "`ORTHOGRAPHIC`", by(camera(28.0).model(Model::ORTHOGRAPHIC))),
            drawn("fisheye", "`FISHEYE`, 280 degrees wide", by(camera(41.0).model(Model::FISHEYE))),
            drawn("panorama", "`EQUIRECTANGULAR`", by(panorama)),
        ],
    }
}

fn projections(scenes: &Scenes) -> Room<'_> {
    let one = |way| with(picture(&scenes.wide, 38.0), |state| state.linearization(way));
    Room {
        title: "Projection",
        text: "Gaussians that are elongated away from the eye, in a field of view of 137 degrees. The Jacobian depends \
               only on their centres; the unscented transform also uses points away from the centres.",
        exhibits: vec![
            drawn("jacobian", "`JACOBIAN`", one(Linearization::JACOBIAN)),
            drawn("unscented", "`UNSCENTED`", one(Linearization::UNSCENTED)),
        ],
    }
}

fn shaders(scenes: &Scenes) -> Room<'_> {
    let fixed = || picture(&scenes.still, 150.0);
    let shaded = || Picture { by_shader: true, ..fixed() };
    let resolved = |resolve| Picture { resolve: Some(resolve), ..fixed() };
    Room {
        title: "Shaders",
        text: "A vertex shader that projects as the device does, and resolve shaders that compute colours from the \
               accumulated colour and alpha or from the depths.",
        exhibits: vec![
            drawn("fixed-function", "`FIXED_FUNCTION`", fixed()),
            drawn("vertex-shader", "`VERTEX_SHADER`", shaded()),
            difference("vertex-shader-difference", "their difference, 100 times", [fixed(), shaded()], 100.0),
            drawn("resolve-tones", "a resolve shader", resolved(Resolve::Tones)),
            drawn("resolve-expected", "a resolve shader of the expected depth", resolved(Resolve::Expected)),
            drawn("resolve-median", "a resolve shader of the median depth", resolved(Resolve::Median)),
        ],
    }
}

fn orders(scenes: &Scenes) -> Room<'_> {
    let one = |order| with(picture(&scenes.crossing, 60.0), |state| state.order(order));
    Room {
        title: "Orders",
        text: "Two crossing sheets, and at the sides pairs of Gaussians: one has the greater depth, the other the \
               greater distance from the eye. The orders are by depth, by distance, by position in the draw, and at \
               each pixel by the depth on its ray at which the Gaussian is greatest.",
        exhibits: vec![
            drawn("order-view-depth", "`VIEW_DEPTH`", one(Order::VIEW_DEPTH)),
            drawn("order-distance", "`RADIAL_DISTANCE`", one(Order::RADIAL_DISTANCE)),
            drawn("order-primitive", "`PRIMITIVE`", one(Order::PRIMITIVE)),
            drawn("order-per-pixel", "`PER_PIXEL`", one(Order::PER_PIXEL)),
        ],
    }
}

fn merged(scenes: &Scenes) -> Room<'_> {
    let apart = || Picture { draws: &scenes::RINGS, ..picture(&scenes.links, 150.0) };
    Room {
        title: "Several draws",
        text: "Two linked rings, each a draw. The draws are composited one after the other, or they are one sorted set.",
        exhibits: vec![
            drawn("draws", "draws in their order", apart()),
            drawn("draws-merged", "`vkCmdBeginGaussianSetGAURAST`", Picture { share_a_set: true, ..apart() }),
        ],
    }
}

fn geometry(scenes: &Scenes) -> Room<'_> {
    let volumes = || picture(&scenes.floor, 90.0);
    let discs = || with(volumes(), |state| state.geometry(Geometry::GAUSSIAN_2D).low_pass_variance(0.5));
    Room {
        title: "Geometry",
        text: "Round discs on a floor and on walls, near the eye. As volumes their pictures are ellipses around the \
               projected centres. As discs they are intersected with each pixel's ray, and the near half is larger.",
        exhibits: vec![
            drawn("volumes", "`GAUSSIAN_3D`", volumes()),
            drawn("discs", "`GAUSSIAN_2D`", discs()),
            difference("discs-difference", "their difference", [volumes(), discs()], 1.0),
        ],
    }
}

fn precision(scenes: &Scenes) -> Room<'_> {
    let single = || picture(&scenes.veils, 150.0);
    let half = || with(single(), |state| state.precision(Precision::FLOAT16));
    Room {
        title: "Precision",
        text: "Tilted needles, whose centre lines are not accurate in binary16, and many faint layers, whose sum is \
               rounded after each layer.",
        exhibits: vec![
            drawn("binary32", "`FLOAT32`", single()),
            drawn("binary16", "`FLOAT16`", half()),
            difference("binary16-difference", "their difference, 8 times", [single(), half()], 8.0),
        ],
    }
}

fn antialiasing(scenes: &Scenes) -> Room<'_> {
    let one = |variance, mode| {
        with(picture(&scenes.needles, 150.0), |state| state.antialiasing(mode).low_pass_variance(variance))
    };
    let (dilate, compensate) = (Antialiasing::DILATE, Antialiasing::OPACITY_COMPENSATED);
    Room {
        title: "Anti-aliasing",
        text: "Needles thinner than a pixel, and thinner to the right. The low-pass filter widens all of them; \
               compensation reduces their opacity accordingly.",
        exhibits: vec![
            drawn("unfiltered", "no filter", one(0.0, dilate)),
            drawn("dilated", "`DILATE`, 0.3 px^2", one(0.3, dilate)),
            drawn("compensated", "`OPACITY_COMPENSATED`, 0.3 px^2", one(0.3, compensate)),
            drawn("compensated-less", "`OPACITY_COMPENSATED`, 0.1 px^2", one(0.1, compensate)),
        ],
    }
}

fn limits(scenes: &Scenes) -> Room<'_> {
    let one = |change: fn(State<'static>) -> State<'static>| with(picture(&scenes.still, 150.0), change);
    Room {
        title: "Floors and ceilings",
        text: "The alpha floor, at which a Gaussian ends; the ceiling of alpha; and the transmittance floor, at which a \
               pixel is finished.",
        exhibits: vec![
            drawn("limits", "the values of 3DGS", one(|state| state)),
            drawn("alpha-floor", "`alphaFloor` 0.3", one(|state| state.alpha_floor(0.3))),
            drawn("alpha-ceiling", "`alphaCeiling` 0.4", one(|state| state.alpha_ceiling(0.4))),
            drawn("transmittance-floor", "`transmittanceFloor` 0.3", one(|state| state.transmittance_floor(0.3))),
        ],
    }
}

/// A triangle across the picture, at half the depth of the still life.
fn triangle() -> Option<Triangle> {
    let [c0, c1] = camera(1.0).depth_coefficients;
    Some(Triangle {
        corners: [[-0.9, 0.85, 0.75, 0.7, 0.6], [0.1, -0.95, 0.9, 0.85, 0.75], [0.85, 0.7, 0.6, 0.55, 0.5]],
        depth: c0 + c1 / scenes::MIDDLE,
    })
}

fn triangles(scenes: &Scenes) -> Room<'_> {
    let one = |samples, coverage| Picture { triangle: triangle(), samples, coverage, ..picture(&scenes.still, 150.0) };
    Room {
        title: "Depth and samples",
        text: "Gaussians in front of a triangle and behind it, tested with its depth buffer.",
        exhibits: vec![
            drawn("still-life", "no triangle", picture(&scenes.still, 150.0)),
            drawn("depth", "one sample", one(Samples::TYPE_1, false)),
            drawn("multisampled", "four samples", one(Samples::TYPE_4, false)),
            difference(
                "multisampled-difference",
                "their difference",
                [one(Samples::TYPE_1, false), one(Samples::TYPE_4, false)],
                1.0,
            ),
            drawn("coverage", "alpha to coverage", one(Samples::TYPE_4, true)),
        ],
    }
}

fn instances(scenes: &Scenes) -> Room<'_> {
    let many = Picture { instances: &scenes.meadow, ..picture(&scenes.flower, 150.0) };
    Room {
        title: "Instances",
        text: "One model, drawn with a matrix for each instance. All instances are sorted together, and the last rows \
               are fainter.",
        exhibits: vec![
            drawn("model", "the model", picture(&scenes.flower, 280.0)),
            drawn("instances", "60 of them in one draw", many),
        ],
    }
}
