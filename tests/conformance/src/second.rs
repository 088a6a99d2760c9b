//! The second implementation, which was written from the text alone, as an implementation under test.

use ash::vk;
use gaurast::vk::{
    GaussianAntialiasingGAURAST as Antialiasing, GaussianCameraModelGAURAST as Model,
    GaussianGeometryGAURAST as Geometry, GaussianLinearizationGAURAST as Linearization, GaussianOrderGAURAST as Order,
    GaussianPrecisionGAURAST as Precision,
};
use gaurast_oracle::oracle::Stored;
use gaurast_second as second;

use crate::draw::{Blend, ColorFormat, Draw};
use crate::implementation::{Error, Implementation};
use crate::judge::{combined_scene, sets};
use crate::picture::Picture;

/// The second implementation.
pub struct Second;

impl Implementation for Second {
    fn name(&self) -> &str {
        "the second implementation"
    }

    fn missing(&self, draw: &Draw) -> Option<&'static str> {
        let state = &draw.state;
        let depth = draw.depth.as_ref();
        let lacks = [
            (state.order != Order::VIEW_DEPTH, "other orders"),
            (state.precision != Precision::FLOAT32, "rasterizationFloat16"),
            (draw.camera.model != Model::PINHOLE, "other cameras"),
            (state.linearization != Linearization::JACOBIAN, "unscentedProjection"),
            (state.geometry != Geometry::GAUSSIAN_3D, "gaussian2D"),
            (draw.camera_in_buffer, "uniformBufferCamera"),
            (draw.distortion.is_some(), "gaussianDistortion"),
            (draw.unscented.is_some(), "unscentedParameters"),
            (draw.instances.is_some(), "gaussianInstancing"),
            (draw.approximation.is_some(), "gaussianApproximation"),
            (draw.footprint.is_some(), "gaussianCutOff"),
            (draw.shown.is_some(), "resolveFragmentShader"),
            (draw.samples > 1, "gaussianMultisample"),
            (draw.blend != Blend::Over || draw.equation.is_some(), "other blending"),
            (draw.write_mask != vk::ColorComponentFlags::RGBA, "write masks"),
            (draw.format != ColorFormat::Float32, "other formats"),
            (draw.scissor.is_some() || draw.area.is_some(), "scissor and render area"),
            (depth.is_some_and(|depth| depth.bounds.is_some()), "depth bounds"),
            (depth.is_some_and(|depth| depth.stencil.is_some()), "stencil"),
        ];
        lacks.iter().find(|(lacks, _)| *lacks).map(|(_, what)| *what)
    }

    fn draw(&self, draw: &Draw, stored: &Stored) -> Result<Picture, Error> {
        let pixels = (draw.size[0] * draw.size[1]) as usize;
        let format = draw.depth.as_ref().map(|depth| depth.oracle_format());
        let depths = stored.depth.iter();
        let mut attachments = second::Attachments {
            width: draw.size[0] as usize,
            color: vec![draw.behind; pixels],
            depth: depths.map(|&code| format.map_or(0.0, |format| format.depth(code))).collect(),
        };
        for members in sets(draw) {
            let (scene, _) = combined_scene(draw, &members);
            let stored = (scene.degree + 1).pow(2) as usize;
            let drawn = (draw.degree + 1).pow(2) as usize;
            let gaussians: Vec<second::Gaussian> = (0..scene.positions.len())
                .map(|index| second::Gaussian {
                    position: scene.positions[index],
                    scale: scene.scales[index],
                    rotation: scene.rotations[index],
                    opacity: scene.opacities[index],
                    harmonics: &scene.sh[index * stored..][..drawn],
                })
                .collect();
            let (camera, viewport, state) = (camera(draw), viewport(draw), state(draw));
            second::draw(&gaussians, &camera, &viewport, &state, test(draw), &mut attachments);
        }
        let codes = attachments.depth.iter();
        let depth = match format {
            Some(format) => codes.map(|&depth| format.code(depth)).collect(),
            None => Vec::new(),
        };
        let stored = Stored { depth, stencil: stored.stencil.clone() };
        Ok(Picture { color: attachments.color, stored })
    }
}

fn camera(draw: &Draw) -> second::Camera {
    let camera = &draw.camera;
    let [xx, xy, xz, yx, yy, yz, zx, zy, zz] = camera.rotation;
    second::Camera {
        rotation: [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]],
        eye: camera.eye,
        focal_length: camera.focal_length,
        principal_point: camera.principal_point,
        near_plane: camera.near_plane,
        far_plane: camera.far_plane,
        depth_coefficients: camera.depth_coefficients,
    }
}

fn viewport(draw: &Draw) -> second::Viewport {
    let viewport = draw.viewport();
    second::Viewport {
        x: viewport.x,
        y: viewport.y,
        width: viewport.width,
        height: viewport.height,
        min_depth: viewport.min_depth,
        max_depth: viewport.max_depth,
    }
}

fn state(draw: &Draw) -> second::State {
    let state = &draw.state;
    second::State {
        spherical_harmonics_degree: draw.degree as usize,
        antialiasing: match state.antialiasing {
            Antialiasing::OPACITY_COMPENSATED => second::Antialiasing::OpacityCompensated,
            _ => second::Antialiasing::Dilate,
        },
        low_pass_variance: state.low_pass_variance,
        alpha_floor: state.alpha_floor,
        alpha_ceiling: state.alpha_ceiling,
        transmittance_floor: state.transmittance_floor,
    }
}

fn test(draw: &Draw) -> Option<second::DepthTest> {
    use second::CompareOp as Op;
    let depth = draw.depth.as_ref()?;
    let (compare, write) = depth.test?;
    Some(second::DepthTest {
        compare: match compare {
            vk::CompareOp::NEVER => Op::Never,
            vk::CompareOp::LESS => Op::Less,
            vk::CompareOp::EQUAL => Op::Equal,
            vk::CompareOp::LESS_OR_EQUAL => Op::LessOrEqual,
            vk::CompareOp::GREATER => Op::Greater,
            vk::CompareOp::NOT_EQUAL => Op::NotEqual,
            vk::CompareOp::GREATER_OR_EQUAL => Op::GreaterOrEqual,
            _ => Op::Always,
        },
        write,
        format: match depth.texel() {
            2 => second::DepthFormat::Unorm16,
            _ if depth.format == vk::Format::X8_D24_UNORM_PACK32 => second::DepthFormat::Unorm24,
            _ => second::DepthFormat::Float32,
        },
    })
}
