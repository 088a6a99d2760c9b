//! Arguments that commands share, and those of `gaurast render`.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, ValueEnum};
use gaurast_picture::{Background, DEFAULT_QUALITY, Size};
use gaurast_scene::{MAX_SH_DEGREE, Transform};
use glam::{DQuat, DVec3};

use crate::renderers::OtherRenderer;

/// What every command's help ends with.
pub const EXIT_CODES: &str = "Exit codes: 0 done, 1 it failed and one sentence on stderr says why, 2 the command line means \
    nothing.";

#[derive(Args, Default)]
#[command(after_help = format!("Scenes are read from {} files, as far as there is a reader; in a folder, INRIA's \
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
}

/// What is drawn.
#[derive(Args, Clone, Debug, Default)]
pub struct SceneArguments {
    /// The scene: a file, a folder, or - for standard input; several are drawn together; a generated garden if there is none
    pub scenes: Vec<PathBuf>,

    /// Put a scene elsewhere: "scale=F turn=X,Y,Z,DEGREES move=X,Y,Z", each if wanted
    ///
    /// The first one is of the first scene, the second of the second, and so on; "" leaves a scene where it is. It is scaled
    /// first, then turned about an axis through the origin, then moved.
    #[arg(long, value_name = "SPEC", allow_hyphen_values = true)]
    pub transform: Vec<Placement>,

    /// The level of detail of a scene that has several: 0 is the finest
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub level: u32,
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
            let numbers = values
                .split(',')
                .map(finite)
                .collect::<Result<Vec<f64>, _>>()?;
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

/// Where the scene is seen from.
#[derive(Args, Clone, Default)]
#[command(next_help_heading = "Camera")]
pub struct CameraArguments {
    /// A camera file: cameras.json of 3DGS, transforms.json or camera_path.json of nerfstudio, or COLMAP's folder
    #[arg(long, value_name = "FILE", conflicts_with_all = ["eye", "target", "up", "fov", "azimuth", "elevation", "distance", "orbit", "path"])]
    pub cameras: Option<PathBuf>,

    /// Which cameras of the file: an index from 0, a range such as 3..7 or 0..100:10, a name, or all
    ///
    /// May be given more than once. A range holds both of its ends; what is after the colon is its step. A name is
    /// that of a photograph, with or without its folder and its extension.
    #[arg(
        long,
        value_name = "N|N..M|NAME|all",
        value_delimiter = ',',
        conflicts_with_all = ["eye", "target", "up", "fov", "azimuth", "elevation", "distance", "orbit", "path"]
    )]
    pub view: Vec<String>,

    /// nerfstudio's dataparser_transforms.json, which lies beside the trained model
    ///
    /// nerfstudio trains in a frame and at a scale of its own; this takes the cameras of its transforms.json there.
    #[arg(long, value_name = "FILE", requires = "cameras")]
    pub dataparser: Option<PathBuf>,

    /// Draw with cameras whose lens distorts as if it did not
    ///
    /// Without it, a camera with distortion is refused. nerfstudio and gsplat train on undistorted pictures.
    #[arg(long)]
    pub undistorted: bool,

    /// The camera's position
    ///
    /// Without it, the camera has the whole scene in the picture; a panorama and a fisheye stand in its middle.
    #[arg(
        long,
        value_name = "X,Y,Z",
        requires = "target",
        allow_hyphen_values = true,
        conflicts_with_all = ["azimuth", "elevation", "distance"]
    )]
    pub eye: Option<Triple>,

    /// The point that the camera looks at
    #[arg(
        long,
        value_name = "X,Y,Z",
        requires = "eye",
        allow_hyphen_values = true
    )]
    pub target: Option<Triple>,

    /// The direction that is upwards, in the scene and in the picture [default: 0,-1,0]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub up: Option<Triple>,

    /// From which side: 0 is the front, 90 the right, 180 the back [default: 19.3]
    ///
    /// `gaurast views SCENE` shows eight of them.
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true, value_parser = finite)]
    pub azimuth: Option<f64>,

    /// From how far above the horizon, -90 to 90 [default: 18.3; 0 inside]
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true, value_parser = elevation)]
    pub elevation: Option<f64>,

    /// From how far off the scene's middle, in its units [default: all of it is in the picture]
    #[arg(long, value_name = "D", value_parser = positive)]
    pub distance: Option<f64>,

    /// How many times larger than otherwise the picture's contents are
    #[arg(long, value_name = "FACTOR", value_parser = positive)]
    pub zoom: Option<f64>,

    /// N views evenly around the scene, or around the target
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000), conflicts_with = "path")]
    pub orbit: Option<u32>,

    /// Views along a smooth path through the keyframes of a file
    ///
    /// A JSON list of {"eye": [x,y,z], "target": [x,y,z]}, with "up", "fov" and "time" where they are wanted, as
    /// --frame prints them.
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["eye", "target", "up", "fov", "azimuth", "elevation", "distance"])]
    pub path: Option<PathBuf>,

    /// How many views there are along the path [default: its keyframes]
    #[arg(long, value_name = "N", requires = "path", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub frames: Option<u32>,

    /// How the camera projects
    ///
    /// An equirectangular picture is a panorama of 360 by 180 degrees about the camera's position, with the direction
    /// in which it looks in the middle; give it twice as many columns as rows.
    #[arg(long = "camera", value_name = "MODEL", value_enum, default_value_t)]
    pub model: CameraModel,

    /// The vertical field of view; of no account for a panorama [default: 50; 42 for the garden; 180 for a fisheye]
    #[arg(long, value_name = "DEGREES", value_parser = field_of_view)]
    pub fov: Option<f64>,

    /// Leave out what is nearer than this [default: 0.2 as 3DGS, less where the scene is small]
    #[arg(long, value_name = "Z", value_parser = positive)]
    pub near: Option<f64>,

    /// Leave out what is farther off than this [default: nothing]
    #[arg(long, value_name = "Z", value_parser = positive)]
    pub far: Option<f64>,

    /// The picture's size in pixels [default: 1280x720, or the camera file's]
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,

    /// Print the cameras as JSON, which --path reads, and draw nothing
    #[arg(long)]
    pub frame: bool,
}

/// How Gaussians are drawn.
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

    /// What the Gaussians are sorted by
    #[arg(long, value_enum, default_value_t)]
    pub order: Order,

    /// What the Gaussians are
    #[arg(long, value_enum, default_value_t)]
    pub geometry: Geometry,

    /// What becomes of Gaussians that are smaller than a pixel
    #[arg(long, value_enum, default_value_t)]
    pub antialiasing: Antialiasing,

    /// The rasterizer's arithmetic
    #[arg(long, value_enum, default_value_t)]
    pub precision: Precision,

    /// Let the exponential err by at most this, relative to it
    #[arg(long, value_name = "E", default_value_t = 0.0, value_parser = part)]
    pub exponential_error: f32,

    /// Leave contributions out whose weights at a pixel add up to at most this
    ///
    /// A pixel errs by at most the budget times the brightest colour that is left out, which may exceed 1: with 0.004,
    /// one of 255 steps, real scenes err by up to 1.16 steps, and rounding to 8 bits may add one.
    #[arg(long, value_name = "B", default_value_t = 0.0, value_parser = part)]
    pub contribution_budget: f32,
}

impl ModeArguments {
    /// Camera options, with the near plane of the renderer that is followed, unless they say another one.
    pub fn cameras(&self, arguments: &CameraArguments) -> CameraArguments {
        CameraArguments {
            near: arguments
                .near
                .or(self.renderer.and_then(OtherRenderer::near)),
            ..arguments.clone()
        }
    }
}

/// What is written, and where.
#[derive(Args, Default)]
#[command(next_help_heading = "Output")]
pub struct OutputArguments {
    /// Where the picture goes; may be given more than once [default: the scene's name with .png]
    ///
    /// PNG and WebP (without losses) and JPEG have 8 bits, with colours as they are trained; EXR has 32-bit floats.
    /// Several views go to a pattern such as view_%04d.png, to a folder (its name ends in /), to a video (.mp4 or
    /// .webm, made by an ffmpeg on the PATH), or one after the other as PNG to standard output (-).
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,

    /// Replace files that are there
    #[arg(long)]
    pub force: bool,

    /// Keep files that are there, and draw only the views that lack one
    ///
    /// Files appear whole or not at all, so one that is there is complete.
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,

    /// Draw only every n-th view, from the i-th on: i is 0 to n - 1
    ///
    /// Several machines or processes share views so: --shard $SLURM_ARRAY_TASK_ID/8.
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,

    /// What is behind the scene: transparent, a name, #rgb, #rrggbb, or R,G,B, each 0 to 1
    ///
    /// The scene is composited over a colour: C + T background, with alpha 1. Without it, EXR files
    /// hold (C, 1 - T), premultiplied, and the other files are opaque over black. Transparent PNG and WebP files have
    /// straight alpha.
    #[arg(long, value_name = "COLOUR", allow_hyphen_values = true)]
    pub background: Option<Background>,

    /// The quality of JPEG files, 1 to 100
    #[arg(long, value_name = "Q", default_value_t = DEFAULT_QUALITY, value_parser = clap::value_parser!(u8).range(1..=100))]
    pub quality: u8,

    /// EXR files hold linear light instead of colours as they are trained, which are sRGB
    #[arg(long)]
    pub linear: bool,

    /// EXR files hold depths, too: the median as Z, the expected one as expected.Z
    #[arg(long)]
    pub depth: bool,

    /// Also draw how many Gaussians contribute to a pixel, as the mean of each 16x16 tile
    #[arg(long, value_name = "FILE")]
    pub heatmap: Option<PathBuf>,

    /// Frames of a video in a second
    #[arg(long, value_name = "N", default_value_t = 30.0, value_parser = positive)]
    pub fps: f64,

    /// Standard output gets raw frames, 3 bytes a pixel, instead of PNG
    #[arg(long)]
    pub raw: bool,
}

/// What is told.
#[derive(Args, Clone, Copy, Default)]
#[command(next_help_heading = "Report")]
pub struct ReportArguments {
    /// Print what each stage of the device did, as far as it did something
    #[arg(long)]
    pub stats: bool,

    /// Count also what the simulated hardware would spend: cycles, stalls, energy
    ///
    /// `gaurast simulate` tells more, of any hardware.
    #[arg(long)]
    pub counters: bool,

    /// Print everything as JSON
    #[arg(long)]
    pub json: bool,

    /// Fail where a picture has nothing in it, instead of saying so
    #[arg(long)]
    pub strict: bool,

    /// Print nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// What `--camera` may be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum CameraModel {
    /// Perspective, or what the camera file says
    #[default]
    Pinhole,
    /// An equidistant fisheye
    Fisheye,
    /// A panorama by longitude and latitude
    Equirectangular,
    /// Parallel rays
    Orthographic,
}

/// Values of `--order`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Order {
    /// What the file says; depth where it says nothing
    #[default]
    Auto,
    /// Depth along the camera's axis, as 3DGS does
    Depth,
    /// Distance from the camera
    Distance,
    /// Depth along each pixel's own ray: nothing pops as the camera turns
    PerPixel,
}

/// Values of `--geometry`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Geometry {
    /// What the file says; volumes where it says nothing
    #[default]
    Auto,
    /// Volumes with three axes, as of 3DGS
    #[value(name = "3d")]
    Volume,
    /// Flat discs with two, as of 2DGS; a third scale is not looked at
    #[value(name = "2d")]
    Surfel,
}

/// Values of `--antialiasing`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Antialiasing {
    /// What the file says; off where it says nothing
    #[default]
    Auto,
    /// They are dilated and keep their opacity, as 3DGS does
    Off,
    /// Their opacity makes up for the dilation: for scenes that are trained so
    Compensated,
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

/// A share of the views: those whose place leaves `index` when divided by `count`.
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
                Some(Self {
                    index: index.trim().parse().ok()?,
                    count: count.trim().parse().ok()?,
                })
            })
            .filter(|shard| shard.index < shard.count)
            .ok_or("a share is I/N, with I from 0 to N - 1")
    }
}

/// Three finite numbers with commas between them.
#[derive(Clone, Copy, Debug)]
pub struct Triple(pub [f64; 3]);

impl FromStr for Triple {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let numbers: Option<Vec<f64>> = text
            .split(',')
            .map(|word| word.trim().parse().ok().filter(|x: &f64| x.is_finite()))
            .collect();
        numbers
            .and_then(|numbers| numbers.try_into().ok())
            .map(Self)
            .ok_or("three numbers are needed, with commas between them")
    }
}

fn part(text: &str) -> Result<f32, &'static str> {
    text.parse()
        .ok()
        .filter(|part| (0.0..=1.0).contains(part))
        .ok_or("it is at least 0 and at most 1")
}

fn finite(text: &str) -> Result<f64, &'static str> {
    text.parse()
        .ok()
        .filter(|number: &f64| number.is_finite())
        .ok_or("it is a number")
}

pub fn positive(text: &str) -> Result<f64, &'static str> {
    finite(text)
        .ok()
        .filter(|number| *number > 0.0)
        .ok_or("it is a number greater than 0")
}

fn elevation(text: &str) -> Result<f64, &'static str> {
    finite(text)
        .ok()
        .filter(|degrees| degrees.abs() <= 90.0)
        .ok_or("it is at least -90 and at most 90 degrees")
}

fn field_of_view(text: &str) -> Result<f64, &'static str> {
    text.parse()
        .ok()
        .filter(|degrees| *degrees > 0.0 && *degrees < 180.0)
        .ok_or("it is more than 0 and less than 180 degrees")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triples() {
        assert_eq!(
            "1,-2.5, 3e2".parse::<Triple>().map(|t| t.0),
            Ok([1., -2.5, 300.])
        );
        for bad in ["1,2", "1,2,3,4", "a,b,c", "nan,0,0", "inf,0,0", ""] {
            assert!(bad.parse::<Triple>().is_err(), "{bad}");
        }
    }

    #[test]
    fn transforms() {
        let placement: Placement = "scale=2 turn=0,0,5,90 move=1,-2,3".parse().expect("one");
        let Transform {
            scale,
            rotation,
            translation,
        } = placement.0;
        assert_eq!((scale, translation), (2.0, DVec3::new(1.0, -2.0, 3.0)));
        assert!((rotation * DVec3::X).abs_diff_eq(DVec3::Y, 1e-12));
        assert_eq!("".parse(), Ok(Placement::default()));
        for bad in [
            "scale=0",
            "move=1,2",
            "turn=0,0,0,9",
            "shift=1",
            "scale",
            "scale=nan",
        ] {
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
