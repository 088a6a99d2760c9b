//! What a pipeline's shaders read and write at the locations that the Gaussian state names.

use gaurast::vk::{
    GAUSSIAN_LOCATION_UNUSED_GAURAST as UNUSED, GaussianResolveInputLocationsGAURAST,
    GaussianVertexOutputLocationsGAURAST,
};

use crate::report::Faults;
use crate::spirv::{Interface, Slots};

/// Checks the outputs of a projecting vertex shader; without its code, the locations alone.
pub(crate) fn check_vertex(
    locations: &GaussianVertexOutputLocationsGAURAST,
    outputs: Option<&Interface>,
    faults: &mut Faults,
) {
    let id = "VUID-VkGaussianVertexOutputLocationsGAURAST-None-90020";
    let named = [
        ("covariance", locations.covariance, 3),
        ("opacity", locations.opacity, 1),
        ("color", locations.color, 3),
        ("depthKey", locations.depth_key, 1),
    ];
    let mut seen: Vec<(&str, u32)> = Vec::new();
    for (name, location, components) in named {
        if location == UNUSED {
            if name != "depthKey" {
                return faults.error(
                    id,
                    format!("{name} is unused, but vertex-shader projection needs it"),
                );
            }
            continue;
        }
        if let Some((other, _)) = seen.iter().find(|(_, other)| *other == location) {
            return faults.error(
                id,
                format!("{name} and {other} are the same location, {location}"),
            );
        }
        seen.push((name, location));
        let writes =
            |slots: &Slots| (0..components).all(|c| slots.get(&(location, c)) == Some(&true));
        if outputs.is_some_and(|outputs| !writes(&outputs.slots)) {
            return faults.error(
                id,
                format!(
                    "{name} is location {location}, at which the vertex shader must write {components} components of \
                         32-bit \
                     floating point, but does not"
                ),
            );
        }
    }
}

/// Checks the inputs of a resolve shader; without its code, the locations alone.
pub(crate) fn check_fragment(
    locations: &GaussianResolveInputLocationsGAURAST,
    inputs: Option<&Interface>,
    faults: &mut Faults,
) {
    let id = "VUID-VkGaussianResolveInputLocationsGAURAST-None-90023";
    let (color, depth) = (locations.accumulated_color, locations.depth);
    if color == depth && color != UNUSED {
        return faults.error(
            id,
            format!("accumulatedColor and depth are the same location, {color}"),
        );
    }
    let Some(inputs) = inputs else { return };
    let is_there = |&(&(location, component), &is_float): &(&(u32, u32), &bool)| {
        let is_color = location == color && component < 4;
        let is_depth = location == depth && component < 2;
        !(is_float && (is_color || is_depth))
    };
    if let Some((&(location, component), is_float)) = inputs.slots.iter().find(is_there) {
        let text = if *is_float {
            format!(
                "the fragment shader reads component {component} of location {location}, where nothing is: \
                     accumulatedColor is \
                 location {}, and depth {}",
                place(color),
                place(depth)
            )
        } else {
            format!(
                "the fragment shader reads location {location} as something other than 32-bit floating point"
            )
        };
        return faults.error(id, text);
    }
    faults.require(
        !inputs.writes_depth,
        "VUID-VkGraphicsPipelineCreateInfo-FragDepth-90024",
        || "the fragment shader writes FragDepth, but depths are those of Gaussians".to_owned(),
    );
}

fn place(location: u32) -> String {
    if location == UNUSED {
        "unused".to_owned()
    } else {
        location.to_string()
    }
}
