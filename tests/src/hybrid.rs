//! Helpers for scenes of Gaussians and triangles: positions in clip coordinates, and the contents of targets.

use ash::vk;
use gaurast::vk::GaussianCameraGAURAST;
use gaurast_testkit::{Output, Picture, TargetOptions};
use glam::{DMat3, DVec3};

use crate::oracle::{OracleDepthFormat, Stored};

/// The transform from world space to clip coordinates that makes triangles match Gaussians.
#[derive(Clone, Copy)]
pub struct ToClip {
    /// A pinhole camera, whose depth coefficients are those of a perspective projection.
    pub camera: GaussianCameraGAURAST<'static>,
    /// The picture's width and height in pixels.
    pub size: [u32; 2],
}

impl ToClip {
    /// The clip coordinates of a vertex.
    pub fn position(&self, point: DVec3) -> [f32; 4] {
        let camera = &self.camera;
        let rotation = DMat3::from_cols_array(&camera.rotation.map(f64::from)).transpose();
        let t = rotation * (point - DVec3::from(camera.eye));
        let place = |axis: usize, t: f64, z: f64| {
            let (focal, principal) = (camera.focal_length[axis], camera.principal_point[axis]);
            let size = f64::from(self.size[axis]);
            2.0 * (f64::from(focal) * t + f64::from(principal) * z) / size - z
        };
        let [c0, c1] = camera.depth_coefficients.map(f64::from);
        [place(0, t.x, t.z), place(1, t.y, t.z), c0 * t.z + c1, t.z].map(|c| c as f32)
    }
}

/// The contents of a target at one sample of each pixel.
#[derive(Clone, Debug, Default)]
pub struct Held {
    /// The first colour attachment, of four 32-bit floats.
    pub color: Vec<[f32; 4]>,
    /// Depths, if any, as numbers of their format, and stencils. Stencils are present only with one sample per pixel.
    pub stored: Stored,
}

/// The format of a target's depth.
///
/// # Panics
/// If it has none.
pub fn depth_format(options: &TargetOptions) -> OracleDepthFormat {
    use vk::Format as F;
    match options.depth {
        Some(F::D16_UNORM | F::D16_UNORM_S8_UINT) => OracleDepthFormat::Unorm(16),
        Some(F::X8_D24_UNORM_PACK32 | F::D24_UNORM_S8_UINT) => OracleDepthFormat::Unorm(24),
        Some(F::D32_SFLOAT | F::D32_SFLOAT_S8_UINT) => OracleDepthFormat::Float,
        other => panic!("{other:?} is no depth format"),
    }
}

/// The contents of a target, sample by sample.
///
/// # Panics
/// If its first colour attachment is not of four 32-bit floats.
pub fn held(options: &TargetOptions, output: &Output) -> Vec<Held> {
    let format = depth_format(options);
    let codes = |picture: &Picture| -> Vec<u32> {
        match picture.format {
            vk::Format::D16_UNORM => {
                let texels = picture.texels::<u16>();
                texels.into_iter().map(u32::from).collect()
            }
            vk::Format::X8_D24_UNORM_PACK32 => {
                let texels = picture.texels::<u32>();
                texels.into_iter().map(|texel| texel & 0xFF_FFFF).collect()
            }
            // A float depth, or a sample of a depth that was fetched as a float.
            _ => {
                let texels = picture.texels::<f32>();
                texels.into_iter().map(|depth| format.code(depth.into())).collect()
            }
        }
    };
    let find = |name: &str, sample: u32| {
        let name = match options.samples {
            1 => name.to_owned(),
            _ => format!("{name} sample {sample}"),
        };
        output.pictures.iter().find(|picture| picture.name == name)
    };
    (0..options.samples)
        .map(|sample| Held {
            color: find("color 0", sample).map_or_else(Vec::new, Picture::texels),
            stored: Stored {
                depth: find("depth", sample).map_or_else(Vec::new, codes),
                stencil: find("stencil", sample).map_or_else(Vec::new, |p| p.bytes.clone()),
            },
        })
        .collect()
}
