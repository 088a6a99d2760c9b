//! The command line.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, Parser, Subcommand, ValueEnum};
use gaurast_picture::Size;
use gaurast_scene::MAX_SH_DEGREE;

use crate::simulate::SimulateArguments;

/// Renders scenes of 3D Gaussians on a software Vulkan device with a Gaussian primitive topology.
///
/// Without a command, `gaurast` does what `gaurast render` does: it draws a generated garden and
/// writes gaurast.png.
#[derive(Parser)]
#[command(name = "gaurast", version, max_term_width = 100)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Option<Command>,
}

#[derive(Subcommand)]
pub enum Command {
    /// Draws a scene and writes the picture.
    Render(Box<RenderArguments>),
    /// Tells what the simulated hardware would have spent on a scene: time, energy, area
    Simulate(Box<SimulateArguments>),
}

impl Default for Command {
    fn default() -> Self {
        Self::Render(Box::default())
    }
}

#[derive(Args)]
#[command(after_help = format!("Scenes are read from {} files, as far as there is a reader. \
    Their frame is that of 3DGS: x right, y down, z forward.", gaurast_scene::known_extensions()))]
pub struct RenderArguments {
    /// The scene file; a generated garden if there is none
    pub scene: Option<PathBuf>,

    /// A camera file: cameras.json of 3DGS, or transforms.json of nerfstudio
    #[arg(long, value_name = "FILE", conflicts_with_all = ["eye", "target", "up", "fov"])]
    pub cameras: Option<PathBuf>,

    /// Which camera of the file, from 0
    #[arg(long, value_name = "N", requires = "cameras", default_value_t = 0)]
    pub view: usize,

    /// The camera's position
    ///
    /// Without it, the camera has the whole scene in the picture.
    #[arg(
        long,
        value_name = "X,Y,Z",
        requires = "target",
        allow_hyphen_values = true
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

    /// The direction that is upwards in the picture [default: 0,-1,0]
    #[arg(
        long,
        value_name = "X,Y,Z",
        requires = "eye",
        allow_hyphen_values = true
    )]
    pub up: Option<Triple>,

    /// How the camera projects
    ///
    /// An equirectangular picture is a panorama of 360 by 180 degrees about the camera's position, with the direction
    /// in which it looks in the middle; give it twice as many columns as rows.
    #[arg(long, value_name = "MODEL", value_enum, default_value_t)]
    pub camera: CameraModel,

    /// The vertical field of view; of no account for a panorama [default: 50; 42 for the garden; 180 for a fisheye]
    #[arg(long, value_name = "DEGREES", value_parser = field_of_view)]
    pub fov: Option<f64>,

    /// The picture's size in pixels [default: 1280x720, or the camera file's]
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,

    /// The colour behind the scene, each component 0 to 1
    ///
    /// The scene is composited over it: C + T background, with alpha 1. Without it, EXR files
    /// hold (C, 1 - T), premultiplied, and PNG files are opaque over black.
    #[arg(long, value_name = "R,G,B", allow_hyphen_values = true)]
    pub background: Option<Triple>,

    /// Draw with spherical harmonics of at most this degree
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(..=i64::from(MAX_SH_DEGREE)))]
    pub sh_degree: Option<u32>,

    /// What the Gaussians are sorted by
    #[arg(long, value_enum, default_value_t)]
    pub order: Order,

    /// What the Gaussians are
    #[arg(long, value_enum, default_value_t)]
    pub geometry: Geometry,

    /// The rasterizer's arithmetic
    #[arg(long, value_enum, default_value_t)]
    pub precision: Precision,

    /// Let the exponential err by at most this, relative to it
    #[arg(long, value_name = "E", default_value_t = 0.0, value_parser = part)]
    pub exponential_error: f32,

    /// Leave contributions out that change no pixel by more than this together
    ///
    /// In parts of the scene's range of colours, such as 0.004 for one of 255 steps.
    #[arg(long, value_name = "B", default_value_t = 0.0, value_parser = part)]
    pub contribution_budget: f32,

    /// Count also what the simulated hardware would spend: cycles, stalls, energy
    ///
    /// `gaurast simulate` tells more, of any hardware.
    #[arg(long)]
    pub counters: bool,

    /// Print nothing but errors
    #[arg(short, long)]
    pub quiet: bool,

    /// Where the picture goes; may be given more than once
    ///
    /// PNG has 8 bits, with colours as they are trained; EXR has 32-bit floats.
    #[arg(short, long, value_name = "FILE.png|FILE.exr", default_value = DEFAULT_OUTPUT)]
    pub output: Vec<PathBuf>,
}

/// What `--camera` may be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum CameraModel {
    /// Perspective
    #[default]
    Pinhole,
    /// An equidistant fisheye
    Fisheye,
    /// A panorama by longitude and latitude
    Equirectangular,
}

/// Values of `--order`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Order {
    /// Depth along the camera's axis, as 3DGS does
    #[default]
    Depth,
    /// Distance from the camera
    Distance,
    /// Depth along each pixel's own ray: nothing pops as the camera turns
    PerPixel,
}

impl From<Order> for gaurast_render::Order {
    fn from(order: Order) -> Self {
        match order {
            Order::Depth => Self::Depth,
            Order::Distance => Self::Distance,
            Order::PerPixel => Self::PerPixel,
        }
    }
}

/// Values of `--geometry`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Geometry {
    /// Volumes with three axes, as of 3DGS
    #[default]
    #[value(name = "3d")]
    Volume,
    /// Flat discs with two, as of 2DGS; a third scale is not looked at
    #[value(name = "2d")]
    Surfel,
}

impl From<Geometry> for gaurast_render::Geometry {
    fn from(geometry: Geometry) -> Self {
        match geometry {
            Geometry::Volume => Self::Volume,
            Geometry::Surfel => Self::Surfel,
        }
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

const DEFAULT_OUTPUT: &str = "gaurast.png";

impl Default for RenderArguments {
    fn default() -> Self {
        Self {
            scene: None,
            cameras: None,
            view: 0,
            eye: None,
            target: None,
            up: None,
            camera: CameraModel::default(),
            fov: None,
            size: None,
            background: None,
            sh_degree: None,
            order: Order::default(),
            geometry: Geometry::default(),
            precision: Precision::default(),
            exponential_error: 0.0,
            contribution_budget: 0.0,
            counters: false,
            quiet: false,
            output: vec![DEFAULT_OUTPUT.into()],
        }
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

fn field_of_view(text: &str) -> Result<f64, &'static str> {
    text.parse()
        .ok()
        .filter(|degrees| *degrees > 0.0 && *degrees < 180.0)
        .ok_or("it is more than 0 and less than 180 degrees")
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn no_arguments_are_the_defaults_of_render() {
        let arguments = Arguments::parse_from(["gaurast", "render"]);
        let Some(Command::Render(parsed)) = arguments.command else {
            panic!("not render");
        };
        let default = RenderArguments::default();
        assert_eq!(parsed.output, default.output);
        assert_eq!(parsed.view, default.view);
        assert_eq!(parsed.quiet, default.quiet);
        assert!(parsed.scene.is_none() && parsed.size.is_none() && parsed.fov.is_none());
    }

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
}
