//! The arguments of `gaurast eval`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use gaurast_picture::Background;

use super::split::Split;
use crate::args::{ModeArguments, Shard, positive};

/// The arguments of `gaurast eval`.
#[derive(Args)]
#[command(
    after_help = "The cameras, the photographs, their sizes, the views that are left out of training and the background are \
    those of 3DGS's, nerfstudio's or gsplat's training, as far as its files are there; each choice is printed. \
    PSNR and SSIM are as 3DGS's metrics.py, torchmetrics and pytorch-msssim compute them, FLIP is the mean error of the LDR \
    evaluator. LPIPS is not computed: its networks' weights are not part of this program. Means are over views."
)]
pub struct EvalArguments {
    /// The model: a scene, or the folder of a trainer
    pub model: PathBuf,

    /// The data set, with cameras and photographs, or a folder of photographs [default: the one that the trainer names]
    pub photographs: Option<PathBuf>,

    /// The cameras: cameras.json, transforms.json, or COLMAP's folder
    #[arg(long, value_name = "FILE")]
    pub cameras: Option<PathBuf>,

    /// nerfstudio's dataparser_transforms.json, which is next to the trained model
    #[arg(long, value_name = "FILE")]
    pub dataparser: Option<PathBuf>,

    /// Ignore the lens distortion of cameras, since the photographs are undistorted ones; else they are drawn with the lens
    #[arg(long)]
    pub undistorted: bool,

    /// The folder of photographs in the data set, such as images_4
    #[arg(long, value_name = "NAME")]
    pub images: Option<String>,

    /// The measured views: all, every:N, fraction:F, or a file of names [default: those that the trainer tests with]
    ///
    /// every:8 are the first by name and every 8th after it, as 3DGS and gsplat leave them out; fraction:0.9 are those
    /// that nerfstudio leaves out. A file has a name in each line.
    #[arg(long, value_name = "SPLIT")]
    pub split: Option<Split>,

    /// Divide the photographs' size by this [default: the size of the training]
    #[arg(long, value_name = "N", value_parser = positive)]
    pub scale: Option<f64>,

    /// A folder of masks: pixels that are black in a photograph's mask are black in both pictures
    #[arg(long, value_name = "FOLDER")]
    pub masks: Option<PathBuf>,

    /// The values of drawn pictures [default: float for nerfstudio and gsplat, else 8-bit]
    #[arg(long, value_enum)]
    pub values: Option<Values>,

    /// The background of the scene and of transparent photographs [default: that of the training, or black]
    #[arg(long, value_name = "COLOUR")]
    pub background: Option<Background>,

    #[command(flatten)]
    pub modes: ModeArguments,

    /// The folder for the pictures, the results as JSON and CSV, and a page with the worst views first
    #[arg(short, long, value_name = "FOLDER")]
    pub output: Option<PathBuf>,

    /// Replace the results in the folder
    #[arg(long, requires = "output")]
    pub force: bool,

    /// Keep the results in the folder, and measure only the views without one
    #[arg(long, requires = "output", conflicts_with = "force")]
    pub resume: bool,

    /// Measure only every n-th view, starting with the i-th: i is 0 to n - 1
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,

    /// Fail if a view's PSNR is below this
    #[arg(long, value_name = "DB")]
    pub fail_below: Option<f64>,

    /// Print everything as JSON
    #[arg(long)]
    pub json: bool,

    /// Print nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// Values of `--values`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Values {
    /// Rounded to 256 steps, as metrics.py of 3DGS reads them from files
    #[value(name = "8-bit")]
    EightBits,
    /// As they are drawn, clamped to 0 to 1, as nerfstudio and gsplat measure them
    Float,
}

impl Values {
    /// The values in words.
    pub fn describe(self) -> &'static str {
        match self {
            Self::EightBits => "8-bit, as 3DGS's metrics.py reads drawn pictures",
            Self::Float => "float, as nerfstudio and gsplat measure drawn pictures",
        }
    }
}
