//! Arguments that several commands have, and those of `gaurast render`.

use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};
use gaurast_picture::{Background, DEFAULT_QUALITY, Size};
use gaurast_scene::{Antialiasing, Axes, Geometry, MAX_SH_DEGREE, SortOrder, Transform};
use glam::{DQuat, DVec3};

use crate::heatmap::Quantity;
use crate::renderers::OtherRenderer;

/// The end of every command's help.
pub const EXIT_CODES: &str = "Exit codes: 0 done, 1 it failed and one sentence on stderr says why, 2 the command line means \
    nothing.";

#[derive(Args, Default)]
#[command(after_help = format!("Scenes are read from {} files, and meshes from .ply, .glb and .gltf files; in a folder, INRIA's \
    output (of the highest iteration), nerfstudio's splat.ply, or the one scene file there is. \
    Their frame is that of 3DGS: x right, y down, z forward.\n\n{EXIT_CODES}", gaurast_scene::known_extensions()))]
pub struct RenderArguments {
    #[command(flatten)]
    pub scene: SceneArguments,

    #[command(flatten)]
    pub camera: CameraArguments,

    #[command(flatten)]
    pub modes: ModeArguments,

    #[command(flatten)]
    pub output: OutputArguments,

    #[command(flatten)]
    pub report: ReportArguments,

    /// Decode a compressed scene (compressed PLY, SOG, SPZ) when it is read, which takes more memory, and not when it is drawn
    #[arg(long, help_heading = "Drawing")]
    pub decode: bool,
}

/// The scene arguments.
#[derive(Args, Clone, Debug, Default)]
pub struct SceneArguments {
    /// The scene: a file, a folder, or - for standard input; several, and meshes among them, are drawn together; a
    /// generated garden if there is none
    pub scenes: Vec<PathBuf>,

    /// Place a scene: "scale=F turn=X,Y,Z,DEGREES move=X,Y,Z", each part optional
    ///
    /// The first value belongs to the first scene, the second to the second, and so on; "" leaves a scene where it is.
    /// The scene is scaled first, then rotated about an axis through the origin, then moved.
    #[arg(long, value_name = "SPEC", allow_hyphen_values = true)]
    pub transform: Vec<Placement>,

    /// The directions of a file's axes x, y and z, or auto
    ///
    /// Three letters of right, left, up, down, front and back: rdf for 3DGS, rub for OpenGL, rfu for z upwards. With auto
    /// they are what the file says, or, of SPZ, the ones with which the scene's ground is below, or the format's. The first
    /// value belongs to the first scene, and so on; the last one also belongs to those that follow. --up turns the camera
    /// alone.
    #[arg(long, value_name = "XYZ|auto", value_parser = axes)]
    pub axes: Vec<Choice<Axes>>,

    /// Draw points without scales as round points of this diameter, in the scene's units
    #[arg(long, value_name = "SIZE", value_parser = positive)]
    pub points: Option<f64>,

    /// The level of detail of a scene that has several: 0 is the finest
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub level: u32,
}

fn axes(text: &str) -> Result<Choice<Axes>, &'static str> {
    if text == "auto" { Ok(Choice::Auto) } else { text.parse().map(Choice::Given) }
}

/// A value of `--transform`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placement(pub Transform);

impl FromStr for Placement {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let mut transform = Transform::default();
        for word in text.split_whitespace() {
            let wrong = "a transform is scale=F, turn=X,Y,Z,DEGREES and move=X,Y,Z, with spaces between them";
            let (name, values) = word.split_once('=').ok_or(wrong)?;
            let numbers = values.split(',').map(finite).collect::<Result<Vec<f64>, _>>()?;
            match (name, &numbers[..]) {
                ("scale", &[factor]) if factor > 0.0 => transform.scale = factor,
                ("move", &[x, y, z]) => transform.translation = DVec3::new(x, y, z),
                ("turn", &[x, y, z, degrees]) => {
                    let axis = DVec3::new(x, y, z).try_normalize().ok_or(wrong)?;
                    transform.rotation = DQuat::from_axis_angle(axis, degrees.to_radians());
                }
                _ => return Err(wrong),
            }
        }
        Ok(Self(transform))
    }
}

/// The camera arguments.
#[derive(Args, Clone, Default)]
#[command(next_help_heading = "Camera")]
pub struct CameraArguments {
    /// A camera file: cameras.json of 3DGS, transforms.json or camera_path.json of nerfstudio, or COLMAP's folder
    #[arg(long, value_name = "FILE", conflicts_with_all = ["eye", "target", "up", "fov", "azimuth", "elevation", "distance", "orbit", "path"])]
    pub cameras: Option<PathBuf>,

    /// The cameras of the file: an index from 0, a range such as 3..7 or 0..100:10, a name, or all
    ///
    /// May be given more than once. A range includes both of its ends; the number after the colon is its step. A name
    /// is that of a photograph, with or without its folder and its extension.
    #[arg(
        long,
        value_name = "N|N..M|NAME|all",
        value_delimiter = ',',
        conflicts_with_all = ["eye", "target", "up", "fov", "azimuth", "elevation", "distance", "orbit", "path"]
    )]
    pub view: Vec<String>,

    /// nerfstudio's dataparser_transforms.json, which is next to the trained model
    ///
    /// nerfstudio trains in coordinates and at a scale of its own; this option converts the cameras of its
    /// transforms.json to them.
    #[arg(long, value_name = "FILE", requires = "cameras")]
    pub dataparser: Option<PathBuf>,

    /// Draw with ideal lenses, and ignore the distortion of the camera file's
    ///
    /// Without this option, pictures are drawn as the lens distorts them, up to the angle where it folds. nerfstudio and gsplat
    /// train on undistorted pictures.
    #[arg(long)]
    pub undistorted: bool,

    /// The camera's position
    ///
    /// Without it, the camera is placed so that an object fills most of the picture; of a scene with surroundings, its
    /// middle. A panorama and a fisheye are placed in the scene's middle.
    #[arg(
        long,
        value_name = "X,Y,Z",
        requires = "target",
        allow_hyphen_values = true,
        conflicts_with_all = ["azimuth", "elevation", "distance"]
    )]
    pub eye: Option<Triple>,

    /// The point that the camera looks at [default: the scene's middle]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub target: Option<Triple>,

    /// The upward direction of the scene, which is also up in the picture [default: 0,-1,0]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub up: Option<Triple>,

    /// The side from which the scene is seen: 0 is the front, 90 the right, 180 the back [default: 19.3]
    ///
    /// `gaurast views SCENE` shows eight of them.
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true, value_parser = finite)]
    pub azimuth: Option<f64>,

    /// The camera's elevation above the horizon, -90 to 90 degrees [default: 18.3; 0 inside]
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true, value_parser = elevation)]
    pub elevation: Option<f64>,

    /// The camera's distance from the target, in the scene's units [default: the whole scene is in the picture]
    #[arg(long, value_name = "D", value_parser = positive)]
    pub distance: Option<f64>,

    /// The magnification of the picture's contents
    #[arg(long, value_name = "FACTOR", value_parser = positive)]
    pub zoom: Option<f64>,

    /// N views evenly spaced around the scene, or around the target
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000), conflicts_with = "path")]
    pub orbit: Option<u32>,

    /// Views along a smooth path through the keyframes of a file
    ///
    /// The file is a JSON list of {"eye": [x,y,z], "target": [x,y,z]}, with optional "up", "fov" and "time", as --frame
    /// prints them.
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["eye", "target", "up", "fov", "azimuth", "elevation", "distance"])]
    pub path: Option<PathBuf>,

    /// The number of views along the path [default: its keyframes]
    #[arg(long, value_name = "N", requires = "path", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub frames: Option<u32>,

    /// The camera's projection
    ///
    /// An equirectangular picture is a panorama of 360 by 180 degrees around the camera's position, with the viewing
    /// direction in its middle. It should have twice as many columns as rows.
    #[arg(long = "camera", value_name = "MODEL", value_enum, default_value_t)]
    pub model: CameraModel,

    /// The vertical field of view in degrees; unused for a panorama [default: 50; 42 for the garden; 180 for a fisheye]
    #[arg(long, value_name = "DEGREES", value_parser = field_of_view)]
    pub fov: Option<f64>,

    /// The near plane: nearer Gaussians are not drawn [default: 0.2 as in 3DGS, less if the scene is small]
    #[arg(long, value_name = "Z", value_parser = positive)]
    pub near: Option<f64>,

    /// The far plane: Gaussians farther away are not drawn [default: none]
    #[arg(long, value_name = "Z", value_parser = positive)]
    pub far: Option<f64>,

    /// The picture's size in pixels [default: 1280x720, or the camera file's]
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,

    /// Print the cameras as JSON, which --path reads, and draw nothing
    #[arg(long)]
    pub frame: bool,
}

/// The drawing modes of Gaussians.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Drawing")]
pub struct ModeArguments {
    /// Draw with spherical harmonics of at most this degree
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(..=i64::from(MAX_SH_DEGREE)))]
    pub sh_degree: Option<u32>,

    /// Draw the picture that another renderer would: its cut-off, near plane, thresholds and order
    ///
    /// --order and --near overrule it. With --antialiasing compensated it is that renderer's compensated mode.
    #[arg(long = "as", value_name = "RENDERER", value_enum)]
    pub renderer: Option<OtherRenderer>,

    /// The key that the Gaussians are sorted by
    #[arg(long, value_enum, default_value_t)]
    pub order: Choice<SortOrder>,

    /// The shape of Gaussians
    #[arg(long, value_enum, default_value_t)]
    pub geometry: Choice<Geometry>,

    /// The treatment of Gaussians that are smaller than a pixel
    #[arg(long, value_enum, default_value_t)]
    pub antialiasing: Choice<Antialiasing>,

    /// The rasterizer's arithmetic
    #[arg(long, value_enum, default_value_t)]
    pub precision: Precision,

    /// Allow this relative error of the exponential
    #[arg(long, value_name = "E", default_value_t = 0.0, value_parser = part)]
    pub exponential_error: f32,

    /// Leave out contributions whose weights at a pixel add up to at most this
    ///
    /// The error of a pixel is at most the budget times the brightest colour that is left out, which may exceed 1. With
    /// 0.004, one of 255 steps, trained scenes have errors of up to 1.16 steps, and rounding to 8 bits may add one.
    #[arg(long, value_name = "B", default_value_t = 0.0, value_parser = part)]
    pub contribution_budget: f32,

    /// Draw on the Vulkan device with NAME in its name, and not on this driver's; `list` prints the names
    ///
    /// Devices without the extension draw by compute kernels, in most modes.
    #[arg(long, value_name = "NAME|list")]
    pub device: Option<String>,
}

impl ModeArguments {
    /// Camera options, with the near plane of the renderer that is followed, unless they say another one.
    pub fn cameras(&self, arguments: &CameraArguments) -> CameraArguments {
        CameraArguments { near: arguments.near.or(self.renderer.and_then(OtherRenderer::near)), ..arguments.clone() }
    }
}

/// The files that are written.
#[derive(Args, Default)]
#[command(next_help_heading = "Output")]
pub struct OutputArguments {
    /// The file, folder or video for the pictures; may be given more than once [default: the scene's name with .png]
    ///
    /// PNG and WebP (lossless) and JPEG have 8 bits, with colours as they are trained; EXR has 32-bit floats. Several
    /// views go to a pattern such as view_%04d.png, to a folder (its name ends in /), to a video (.mp4, .webm, .gif or
    /// animated .webp, made by an ffmpeg on the PATH), or one after the other as PNG to standard output (-).
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,

    /// Replace existing files that --output names; the default one is replaced without it
    #[arg(long)]
    pub force: bool,

    /// Keep existing files, and draw only the views without a file
    ///
    /// Files are written as a whole, so an existing file is complete.
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,

    /// Draw only every n-th view, starting with the i-th: i is 0 to n - 1
    ///
    /// With it, several machines or processes can divide the views: --shard $SLURM_ARRAY_TASK_ID/8.
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,

    /// The background of the scene: transparent, a name, #rgb, #rrggbb, or R,G,B, each 0 to 1
    ///
    /// The scene is composited over a colour: C + T background, with alpha 1. By default, EXR files hold premultiplied
    /// (C, 1 - T), and other files are opaque over black. Transparent PNG and WebP files have straight alpha.
    #[arg(long, value_name = "COLOUR", allow_hyphen_values = true)]
    pub background: Option<Background>,

    /// The quality of JPEG files, 1 to 100
    #[arg(long, value_name = "Q", default_value_t = DEFAULT_QUALITY, value_parser = clap::value_parser!(u8).range(1..=100))]
    pub quality: u8,

    /// Write linear light to EXR files, in place of the trained colours, which are sRGB
    #[arg(long)]
    pub linear: bool,

    /// Write depths to EXR files, too: the median as Z, the expected one as expected.Z
    #[arg(long)]
    pub depth: bool,

    /// Also write the median depths: 16-bit PNG or .npy; a file, a pattern such as depth_%04d.png, or a folder
    ///
    /// A PNG file has whole steps of --depth-step, 0 where nothing is, and 65535 for that depth and greater ones. A .npy file
    /// has NumPy's array of binary32, in the scene's units, infinite where nothing is.
    #[arg(long, value_name = "FILE")]
    pub depth_output: Vec<PathBuf>,

    /// The step of depths in PNG files, in the scene's units
    #[arg(long, value_name = "UNITS", default_value_t = 0.001, value_parser = positive, requires = "depth_output")]
    pub depth_step: f64,

    /// Also draw a picture of the work in each 16x16 tile, from black to white
    #[arg(long, value_name = "FILE")]
    pub heatmap: Option<PathBuf>,

    /// The work that --heatmap shows
    #[arg(long, value_name = "QUANTITY", value_enum, default_value_t, requires = "heatmap")]
    pub heatmap_of: Quantity,

    /// The frames per second of a video
    #[arg(long, value_name = "N", default_value_t = 30.0, value_parser = positive)]
    pub fps: f64,

    /// Write raw frames to standard output, 3 bytes a pixel, instead of PNG
    #[arg(long)]
    pub raw: bool,
}

/// The reporting arguments.
#[derive(Args, Clone, Copy, Default)]
#[command(next_help_heading = "Report")]
pub struct ReportArguments {
    /// Print the counters of each stage of the device that are not zero
    #[arg(long)]
    pub stats: bool,

    /// Also count the cost on the simulated hardware: cycles, stalls, energy
    ///
    /// `gaurast simulate` gives more detail, for any hardware.
    #[arg(long)]
    pub counters: bool,

    /// Print everything as JSON
    #[arg(long)]
    pub json: bool,

    /// Fail if a picture is empty, or if a scene's file holds what the picture may lack, instead of only reporting it
    ///
    /// The latter are unknown columns, Gaussians with numbers that are not finite, scales of -inf, and bounds of chunks that
    /// are not finite.
    #[arg(long)]
    pub strict: bool,

    /// Print nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// Values of `--camera`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum CameraModel {
    /// Perspective, or the camera file's model
    #[default]
    Pinhole,
    /// An equidistant fisheye
    Fisheye,
    /// A panorama by longitude and latitude; also named panorama
    #[value(alias = "panorama")]
    Equirectangular,
    /// An orthographic projection
    Orthographic,
}

/// A value from the scene's file, or one that replaces it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Choice<T> {
    #[default]
    Auto,
    Given(T),
}

/// The given value of a choice, or the file's.
pub fn chosen<T>(choice: Choice<T>, of_file: T) -> T {
    match choice {
        Choice::Auto => of_file,
        Choice::Given(value) => value,
    }
}

/// Values of `--order`.
impl ValueEnum for Choice<SortOrder> {
    fn value_variants<'a>() -> &'a [Self] {
        use SortOrder::{Depth, Distance, PerPixel};
        &[Self::Auto, Self::Given(Depth), Self::Given(Distance), Self::Given(PerPixel)]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        // The second name is that of glTF and USD.
        let (name, alias, help) = match self {
            Self::Auto => ("auto", None, "As in the file; depth if the file has no order"),
            Self::Given(SortOrder::Depth) => ("depth", Some("zDepth"), "Depth along the camera's axis, as 3DGS does"),
            Self::Given(SortOrder::Distance) => ("distance", Some("cameraDistance"), "Distance from the camera"),
            Self::Given(SortOrder::PerPixel) => {
                let help = "Depth along each pixel's own ray: nothing pops as the camera rotates";
                ("per-pixel", Some("rayHitDistance"), help)
            }
        };
        Some(PossibleValue::new(name).aliases(alias).help(help))
    }
}

/// Values of `--geometry`.
impl ValueEnum for Choice<Geometry> {
    fn value_variants<'a>() -> &'a [Self] {
        &[Self::Auto, Self::Given(Geometry::Volume), Self::Given(Geometry::Surfel)]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        // The second name is that of USD's kernels.
        let (name, alias, help) = match self {
            Self::Auto => ("auto", None, "As in the file; volumes if the file has no shape"),
            Self::Given(Geometry::Volume) => ("3d", Some("ellipsoid"), "Volumes with three axes, as in 3DGS"),
            Self::Given(Geometry::Surfel) => {
                ("2d", Some("surflet"), "Flat discs with two axes, as in 2DGS; a third scale is ignored")
            }
        };
        Some(PossibleValue::new(name).aliases(alias).help(help))
    }
}

/// Values of `--antialiasing`.
impl ValueEnum for Choice<Antialiasing> {
    fn value_variants<'a>() -> &'a [Self] {
        &[Self::Auto, Self::Given(Antialiasing::Off), Self::Given(Antialiasing::Compensated)]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (name, help) = match self {
            Self::Auto => ("auto", "As in the file; off if the file has no setting"),
            Self::Given(Antialiasing::Off) => ("off", "Gaussians are dilated and keep their opacity, as in 3DGS"),
            Self::Given(Antialiasing::Compensated) => {
                ("compensated", "Their opacity compensates for the dilation: for scenes that are trained so")
            }
        };
        Some(PossibleValue::new(name).help(help))
    }
}

/// Values of `--precision`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Precision {
    /// binary32
    #[default]
    Fp32,
    /// binary16, rounded after every operation
    Fp16,
}

impl From<Precision> for gaurast_render::Precision {
    fn from(precision: Precision) -> Self {
        match precision {
            Precision::Fp32 => Self::Fp32,
            Precision::Fp16 => Self::Fp16,
        }
    }
}

/// A share of the views: those whose index divided by `count` has the remainder `index`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    pub index: usize,
    pub count: usize,
}

impl FromStr for Shard {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        text.split_once('/')
            .and_then(|(index, count)| {
                Some(Self { index: index.trim().parse().ok()?, count: count.trim().parse().ok()? })
            })
            .filter(|shard| shard.index < shard.count)
            .ok_or("a share is I/N, with I from 0 to N - 1")
    }
}

/// Three finite numbers separated by commas.
#[derive(Clone, Copy, Debug)]
pub struct Triple(pub [f64; 3]);

impl FromStr for Triple {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let numbers: Option<Vec<f64>> =
            text.split(',').map(|word| word.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
        numbers
            .and_then(|numbers| numbers.try_into().ok())
            .map(Self)
            .ok_or("three numbers are needed, with commas between them")
    }
}

fn part(text: &str) -> Result<f32, &'static str> {
    text.parse().ok().filter(|part| (0.0..=1.0).contains(part)).ok_or("it is at least 0 and at most 1")
}

fn finite(text: &str) -> Result<f64, &'static str> {
    text.parse().ok().filter(|number: &f64| number.is_finite()).ok_or("it is a number")
}

pub fn positive(text: &str) -> Result<f64, &'static str> {
    finite(text).ok().filter(|number| *number > 0.0).ok_or("it is a number greater than 0")
}

fn elevation(text: &str) -> Result<f64, &'static str> {
    finite(text).ok().filter(|degrees| degrees.abs() <= 90.0).ok_or("it is at least -90 and at most 90 degrees")
}

fn field_of_view(text: &str) -> Result<f64, &'static str> {
    text.parse()
        .ok()
        .filter(|degrees| *degrees > 0.0 && *degrees <= 360.0)
        .ok_or("it is more than 0 and less than 180 degrees, or at most 360 for a fisheye")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triples() {
        assert_eq!("1,-2.5, 3e2".parse::<Triple>().map(|t| t.0), Ok([1., -2.5, 300.]));
        for bad in ["1,2", "1,2,3,4", "a,b,c", "nan,0,0", "inf,0,0", ""] {
            assert!(bad.parse::<Triple>().is_err(), "{bad}");
        }
    }

    #[test]
    fn transforms() {
        let placement: Placement = "scale=2 turn=0,0,5,90 move=1,-2,3".parse().expect("one");
        let Transform { scale, rotation, translation } = placement.0;
        assert_eq!((scale, translation), (2.0, DVec3::new(1.0, -2.0, 3.0)));
        assert!((rotation * DVec3::X).abs_diff_eq(DVec3::Y, 1e-12));
        assert_eq!("".parse(), Ok(Placement::default()));
        for bad in ["scale=0", "move=1,2", "turn=0,0,0,9", "shift=1", "scale", "scale=nan"] {
            assert!(bad.parse::<Placement>().is_err(), "{bad}");
        }
    }

    #[test]
    fn shares() {
        assert_eq!("2/3".parse(), Ok(Shard { index: 2, count: 3 }));
        for bad in ["3/3", "1", "0/0", "-1/2", "a/b"] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }
}
