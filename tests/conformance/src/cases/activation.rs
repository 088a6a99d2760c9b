//! Attributes in the form of trained files: logarithms of scales and logits of opacities.

use gaurast::vk::{GaussianGeometryGAURAST as Geometry, PipelineGaussianStateCreateFlagsGAURAST as Flags};
use gaurast_oracle::oracle::activation::{opacity_of_logit, scale_of_logarithm};
use gaurast_testkit::Buffer;

use super::chapter::Chapter;
use super::scenes::{dense, strange};
use crate::draw::Draw;
use crate::program::Program;

/// A draw whose stored scales and opacities are those of a scene before the functions that the flags name.
fn activated(mut draw: Draw, flags: Flags) -> Program {
    let logarithms: Vec<[f32; 3]> = draw.scene.scales.iter().map(|scale| scale.map(f32::ln)).collect();
    let mut logits: Vec<f32> = draw.scene.opacities.iter().map(|&o| (o / (1.0 - o)).ln()).collect();
    (logits[0], logits[1]) = (f32::INFINITY, f32::NEG_INFINITY);
    if flags.contains(Flags::LOG_SCALE) {
        draw.scene.scales = logarithms.iter().map(|all| all.map(scale_of_logarithm)).collect();
    }
    if flags.contains(Flags::LOGIT_OPACITY) {
        draw.scene.opacities = logits.iter().map(|&logit| opacity_of_logit(logit)).collect();
    }
    Program::on_stage(draw.in_state(|state| state.flags(flags)), move |stage| {
        let (logarithms, logits) = (Buffer::of(stage.gpu, &logarithms), Buffer::of(stage.gpu, &logits));
        stage.run(|commands| {
            if flags.contains(Flags::LOG_SCALE) {
                commands.vertex_buffer(1, &logarithms, 0);
            }
            if flags.contains(Flags::LOGIT_OPACITY) {
                commands.vertex_buffer(3, &logits, 0);
            }
            commands.draw(0..stage.scene.count);
        });
    })
}

pub(super) fn activation(chapter: &mut Chapter<'_>) {
    let both = Flags::LOG_SCALE | Flags::LOGIT_OPACITY;
    for (name, flags) in [("log_scale", Flags::LOG_SCALE), ("logit_opacity", Flags::LOGIT_OPACITY), ("both", both)] {
        for seed in [451, 452] {
            chapter.program(format!("{name}.dense_{seed}"), move || activated(Draw::new(dense(seed, 1)), flags));
        }
        chapter.program(format!("{name}.strange"), move || activated(Draw::new(strange(453)), flags));
        chapter.program(format!("{name}.surfel"), move || {
            let draw = Draw::new(dense(454, 0));
            activated(draw.in_state(|state| state.geometry(Geometry::GAUSSIAN_2D).low_pass_variance(0.5)), flags)
        });
    }
}
