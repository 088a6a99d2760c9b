//! Mistakes in the locations of attributes.

use ash::vk;
use gaurast::vk::GAUSSIAN_LOCATION_UNUSED_GAURAST as UNUSED;
use gaurast::vk::GaussianAttributeLocationsGAURAST;

use crate::stage::{Mistake, attribute, instanced, locations, pipeline, splats, with};

pub fn mistakes() -> Vec<Mistake> {
    let missing = "VUID-VkGaussianAttributeLocationsGAURAST-None-90015";
    let same = "VUID-VkGaussianAttributeLocationsGAURAST-None-90019";
    let of_format = |index: usize, format| {
        move || {
            let mut request = splats();
            request.attributes[index].format = format;
            request
        }
    };
    vec![
        pipeline("no attribute of the rotation", missing, || {
            let mut request = splats();
            request.attributes.retain(|attribute| attribute.location != 2);
            request
        }),
        pipeline("the opacity's location is unused", missing, || {
            with(|s| s.attribute_locations(locations().opacity(UNUSED)))
        }),
        pipeline("fewer coefficients than the degree needs", missing, || with(|s| s.spherical_harmonics_degree(1))),
        pipeline("a rotation of three components", missing, of_format(2, vk::Format::R32G32B32_SFLOAT)),
        pipeline("positions of integers", missing, of_format(0, vk::Format::R32G32B32_SINT)),
        pipeline("two rows of a model matrix", missing, || {
            let mut request = instanced();
            request.attributes.retain(|attribute| attribute.location != 11);
            request
        }),
        pipeline("position and scale at one location", same, || with(|s| s.attribute_locations(locations().scale(0)))),
        pipeline("the structure of locations is zeroed", same, || {
            with(|s| {
                let zeros = GaussianAttributeLocationsGAURAST {
                    position: 0,
                    scale: 0,
                    rotation: 0,
                    opacity: 0,
                    first_spherical_harmonics: 0,
                    first_model_matrix: 0,
                    model_opacity: 0,
                };
                s.attribute_locations(zeros)
            })
        }),
        pipeline("a model opacity of 0, which is a location", same, || {
            with(|s| s.attribute_locations(locations().model_opacity(0)))
        }),
        pipeline("an attribute of a binding that does not exist", missing, || {
            let mut request = splats();
            request.attributes[3] = attribute(3, 7, vk::Format::R32_SFLOAT, 0);
            request
        }),
    ]
}
