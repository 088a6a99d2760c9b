//! Mistakes in dynamic states of the extension.

use ash::vk;
use gaurast::gaussian_primitive_topology::Device;
use gaurast::vk::{
    DYNAMIC_STATE_GAUSSIAN_ALPHA_CEILING_GAURAST as CEILING, DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST as ORDER,
    DYNAMIC_STATE_GAUSSIAN_SPHERICAL_HARMONICS_DEGREE_GAURAST as DEGREE, GaussianAntialiasingGAURAST,
    GaussianOrderGAURAST,
};

use gaurast_testkit::Buffer;

use crate::stage::{IDENTITY, Mistake, SPLAT, camera, drawing, gaussian, instanced, mistake, recording, splats};

type Set = fn(&Device, vk::CommandBuffer);

/// A value that is wrong by itself.
fn value(name: &'static str, id: &'static str, set: Set) -> Mistake {
    mistake(name, id, move |stage| {
        recording(&stage.full, |commands| {
            set(gaussian(&stage.full), commands.raw);
        })
    })
}

/// A draw with a dynamic state.
fn draw(name: &'static str, id: &'static str, state: vk::DynamicState, set: Set) -> Mistake {
    mistake(name, id, move |stage| {
        let request = splats().with_dynamic(state);
        drawing(&stage.full, &request, &[SPLAT], |commands| {
            set(gaussian(&stage.full), commands.raw);
            commands.camera(&camera());
            commands.draw(0..1);
        })
    })
}

pub fn mistakes() -> Vec<Mistake> {
    let mut all = values();
    all.extend(draws());
    all
}

fn values() -> Vec<Mistake> {
    // SAFETY: see the crate; in all of these functions.
    unsafe {
        vec![
            value(
                "a dynamic order that is none",
                "VUID-vkCmdSetGaussianOrderGAURAST-order-parameter",
                |own, commands| {
                    own.cmd_set_gaussian_order(commands, GaussianOrderGAURAST::from_raw(77));
                },
            ),
            value(
                "a dynamic antialiasing that is none",
                "VUID-vkCmdSetGaussianAntialiasingGAURAST-antialiasing-parameter",
                |own, commands| {
                    let none = GaussianAntialiasingGAURAST::from_raw(77);
                    own.cmd_set_gaussian_antialiasing(commands, none);
                },
            ),
            value(
                "a dynamic low-pass variance that is infinite",
                "VUID-vkCmdSetGaussianLowPassVarianceGAURAST-lowPassVariance-90053",
                |own, commands| {
                    own.cmd_set_gaussian_low_pass_variance(commands, f32::INFINITY);
                },
            ),
            value(
                "a dynamic alpha floor above 1",
                "VUID-vkCmdSetGaussianAlphaFloorGAURAST-alphaFloor-90054",
                |own, commands| own.cmd_set_gaussian_alpha_floor(commands, 1.5),
            ),
            value(
                "a dynamic alpha ceiling of 0",
                "VUID-vkCmdSetGaussianAlphaCeilingGAURAST-alphaCeiling-90055",
                |own, commands| own.cmd_set_gaussian_alpha_ceiling(commands, 0.0),
            ),
            value(
                "a dynamic transmittance floor of 1",
                "VUID-vkCmdSetGaussianTransmittanceFloorGAURAST-transmittanceFloor-90056",
                |own, commands| own.cmd_set_gaussian_transmittance_floor(commands, 1.0),
            ),
            value(
                "a dynamic degree that the device does not have",
                "VUID-vkCmdSetGaussianSphericalHarmonicsDegreeGAURAST-sphericalHarmonicsDegree-90057",
                |own, commands| {
                    own.cmd_set_gaussian_spherical_harmonics_degree(commands, 5);
                },
            ),
            value(
                "a dynamic error of the exponential that is NaN",
                "VUID-vkCmdSetGaussianExponentialErrorGAURAST-exponentialError-90058",
                |own, commands| own.cmd_set_gaussian_exponential_error(commands, f32::NAN),
            ),
            value(
                "a negative dynamic budget of contributions",
                "VUID-vkCmdSetGaussianContributionBudgetGAURAST-contributionBudget-90059",
                |own, commands| own.cmd_set_gaussian_contribution_budget(commands, -1.0),
            ),
        ]
    }
}

fn draws() -> Vec<Mistake> {
    let dynamic = "VUID-vkCmdDraw-dynamic-90060";
    // SAFETY: see the crate; in all of these functions.
    unsafe {
        vec![
            draw("a dynamic order that was not set", dynamic, ORDER, |_, _| ()),
            draw("a dynamic alpha ceiling below the pipeline's floor", dynamic, CEILING, |own, commands| {
                own.cmd_set_gaussian_alpha_ceiling(commands, 1e-3);
            }),
            draw(
                "a dynamic degree of more coefficients than the pipeline has",
                "VUID-vkCmdDraw-sphericalHarmonicsDegree-90061",
                DEGREE,
                |own, commands| {
                    own.cmd_set_gaussian_spherical_harmonics_degree(commands, 1);
                },
            ),
            mistake("a dynamic order that model matrices do not go with", dynamic, |stage| {
                let request = instanced().with_dynamic(ORDER);
                let models = Buffer::of(&stage.full, &IDENTITY);
                drawing(&stage.full, &request, &[SPLAT], |commands| {
                    let per_pixel = GaussianOrderGAURAST::PER_PIXEL;
                    gaussian(&stage.full).cmd_set_gaussian_order(commands.raw, per_pixel);
                    commands.vertex_buffer(1, &models, 0);
                    commands.camera(&camera());
                    commands.draw(0..1);
                })
            }),
        ]
    }
}
