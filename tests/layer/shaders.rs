//! Mistakes in what shaders read and write by location.

use gaurast::vk::{
    GAUSSIAN_LOCATION_UNUSED_GAURAST as UNUSED, GaussianOrderGAURAST, GaussianPrecisionGAURAST,
    GaussianResolveInputLocationsGAURAST,
};
use gaurast_testkit::Shader;

use crate::stage::{Mistake, outputs, resolved, shaded, shaders, spirv};

pub fn mistakes() -> Vec<Mistake> {
    let written = "VUID-VkGaussianVertexOutputLocationsGAURAST-None-90020";
    let read = "VUID-VkGaussianResolveInputLocationsGAURAST-None-90023";
    let depths = "VUID-VkGaussianResolveInputLocationsGAURAST-depth-90031";
    vec![
        shaders("a covariance at a location that the shader does not write", written, || {
            shaded(|s| s.vertex_output_locations(outputs().covariance(9)))
        }),
        shaders("a colour at the opacity's location", written, || {
            shaded(|s| s.vertex_output_locations(outputs().color(3)))
        }),
        shaders("no opacity of what a shader projects", written, || {
            shaded(|s| s.vertex_output_locations(outputs().opacity(UNUSED)))
        }),
        shaders(
            "the order of distance without a depth key",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-depthKey-90021",
            || {
                let by_distance = GaussianOrderGAURAST::RADIAL_DISTANCE;
                shaded(|s| s.order(by_distance).vertex_output_locations(outputs().depth_key(UNUSED)))
            },
        ),
        shaders(
            "a camera in a resolve shader of what a shader projects",
            "VUID-VkGaussianResolveInputLocationsGAURAST-firstCamera-90072",
            || {
                let locations =
                    GaussianResolveInputLocationsGAURAST::default().accumulated_color(2).depth(5).first_camera(8);
                let request = shaded(|s| s.resolve_input_locations(locations));
                request.with_shader(Shader::fragment(spirv!("toned.frag")))
            },
        ),
        shaders(
            "the order of each pixel of what a shader projects",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-projectionMode-90022",
            || shaded(|s| s.order(GaussianOrderGAURAST::PER_PIXEL)),
        ),
        shaders("a resolve shader that reads where nothing is", read, || resolved(spirv!("toned.frag"), [3, 5], |s| s)),
        shaders("a resolve shader whose inputs are exchanged", read, || resolved(spirv!("toned.frag"), [5, 2], |s| s)),
        shaders("accumulated colours and depths at one location", read, || {
            resolved(spirv!("woven.frag"), [0, 0], |s| s)
        }),
        shaders("a resolve shader that writes the depth", "VUID-VkGraphicsPipelineCreateInfo-FragDepth-90024", || {
            resolved(spirv!("deep.frag"), [0, 1], |s| s)
        }),
        shaders("depths of binary16", depths, || {
            let half = GaussianPrecisionGAURAST::FLOAT16;
            resolved(spirv!("toned.frag"), [2, 5], |s| s.precision(half))
        }),
        shaders("depths in the order of each pixel", depths, || {
            let per_pixel = GaussianOrderGAURAST::PER_PIXEL;
            resolved(spirv!("toned.frag"), [2, 5], |s| s.order(per_pixel))
        }),
    ]
}
