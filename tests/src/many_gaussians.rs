//! Draws of many Gaussians in each mode that has lists of its own, for tests whose allocations fail.

use gaurast::vk::{
    GaussianCameraGAURAST, GaussianCameraModelGAURAST, GaussianGeometryGAURAST, GaussianOrderGAURAST,
    GaussianPrecisionGAURAST, PipelineGaussianStateCreateInfoGAURAST,
};
use gaurast_testkit::{GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Pass, Target};

use crate::scenes::{Gaussian, SceneBuffers};

/// The mode of a draw of Gaussians.
#[derive(Clone, Copy)]
pub struct Mode {
    /// Its name.
    pub name: &'static str,
    state: PipelineGaussianStateCreateInfoGAURAST<'static>,
    model: GaussianCameraModelGAURAST,
}

impl Default for Mode {
    fn default() -> Self {
        Self {
            name: "Gaussians",
            state: PipelineGaussianStateCreateInfoGAURAST::default(),
            model: GaussianCameraModelGAURAST::PINHOLE,
        }
    }
}

impl Mode {
    /// The modes that have lists of their own.
    pub fn all() -> [Self; 5] {
        let state = PipelineGaussianStateCreateInfoGAURAST::default();
        let plain = Self::default();
        [
            plain,
            Self {
                name: "Gaussians in each pixel's order",
                state: state.order(GaussianOrderGAURAST::PER_PIXEL),
                ..plain
            },
            Self { name: "discs", state: state.geometry(GaussianGeometryGAURAST::GAUSSIAN_2D), ..plain },
            Self { name: "Gaussians in binary16", state: state.precision(GaussianPrecisionGAURAST::FLOAT16), ..plain },
            Self { name: "a panorama", model: GaussianCameraModelGAURAST::EQUIRECTANGULAR, ..plain },
        ]
    }
}

/// Gaussians of many sizes and depths.
pub fn scene(count: usize) -> SceneBuffers {
    let one = |index: usize| {
        let at = |factor: usize, period: usize| (index * factor % period) as f32 / period as f32;
        Gaussian {
            position: [4.0 * at(7, 101) - 2.0, 3.0 * at(13, 97) - 1.5, 2.0 + 4.0 * at(29, 89)],
            scale: [0.02 + 0.1 * at(3, 31), 0.05, 0.03],
            rotation: [1.0, at(5, 17), at(11, 19), 0.3],
            opacity: 0.2 + 0.7 * at(17, 23),
            sh: vec![[at(3, 7), at(5, 11), at(2, 5)]],
        }
    };
    SceneBuffers::new(0, (0..count).map(one))
}

/// Draws a scene three times, so that the driver builds chunks, and returns the picture's bytes. `drawing` is called when
/// this begins and when it ends.
pub fn draw(context: &Gpu, buffers: &SceneBuffers, size: [u32; 2], mode: Mode, drawing: impl Fn(bool)) -> Vec<u8> {
    let options = GaussianOptions { state: mode.state, ..GaussianOptions::new(0) };
    let pipeline = GaussianPipeline::new(context, &options);
    let scene = GaussianScene::new(context, buffers);
    let target = Target::floats(context, size);
    let focal_length = match mode.model {
        // The focal length in pixels per radian; the picture covers the full circle.
        GaussianCameraModelGAURAST::EQUIRECTANGULAR => size[0] as f32 / std::f32::consts::TAU,
        _ => 0.8 * size[0] as f32,
    };
    let camera = GaussianCameraGAURAST::default()
        .model(mode.model)
        .focal_length([focal_length; 2])
        .principal_point(size.map(|side| 0.5 * side as f32));
    drawing(true);
    for _ in 0..3 {
        context.run(|commands| {
            commands.pass(&target, &Pass::clear([0.0; 4]), || {
                scene.bind(commands, &pipeline, &camera);
                commands.draw(0..scene.count);
            });
        });
    }
    drawing(false);
    let pixels: Vec<[f32; 4]> = target.read();
    bytemuck::cast_slice(&pixels).to_vec()
}
