//! The inputs and outputs of a pipeline's shaders at the locations that the Gaussian state names.

use ash::vk;
use gaurast::vk::{
    GAUSSIAN_LOCATION_UNUSED_GAURAST as UNUSED, GaussianResolveInputLocationsGAURAST,
    GaussianVertexOutputLocationsGAURAST,
};

use crate::formats::is_integer;
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
                return faults.error(id, format!("{name} is unused, but vertex-shader projection needs it"));
            }
            continue;
        }
        if let Some((other, _)) = seen.iter().find(|(_, other)| *other == location) {
            return faults.error(id, format!("{name} and {other} are the same location, {location}"));
        }
        seen.push((name, location));
        let writes = |slots: &Slots| (0..components).all(|c| slots.get(&(location, c)) == Some(&true));
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
    let inputs_of_text = resolve_inputs(locations);
    for (index, one) in inputs_of_text.iter().enumerate() {
        let overlaps =
            |other: &&ResolveInput| one.first < other.first + other.count && other.first < one.first + one.count;
        if let Some(other) = inputs_of_text[..index].iter().find(overlaps) {
            return faults.error(
                id,
                format!("{} and {} have the same location, {}", other.name, one.name, one.first.max(other.first)),
            );
        }
    }
    let Some(inputs) = inputs else { return };
    for (&(location, component), &is_float) in &inputs.slots {
        let location_of = u64::from(location);
        let input = inputs_of_text.iter().find(|input| (input.first..input.first + input.count).contains(&location_of));
        let text = match input {
            Some(input) if component >= input.components => format!(
                "the fragment shader reads component {component} of location {location}, but {} has {} components",
                input.name, input.components
            ),
            Some(input) if is_float != input.is_float => {
                let kind = if input.is_float { "32-bit floating point" } else { "32-bit unsigned integers" };
                format!("the fragment shader reads location {location}, {}, as something other than {kind}", input.name)
            }
            Some(_) => continue,
            None => format!(
                "the fragment shader reads component {component} of location {location}, where nothing is: \
                 accumulatedColor is location {}, and depth {}",
                place(locations.accumulated_color),
                place(locations.depth)
            ),
        };
        return faults.error(id, text);
    }
    faults.require(!inputs.writes_depth, "VUID-VkGraphicsPipelineCreateInfo-FragDepth-90024", || {
        "the fragment shader writes FragDepth, but depths are those of Gaussians".to_owned()
    });
}

/// Warns of floating-point outputs to attachments of integers.
pub(crate) fn check_outputs(outputs: &Interface, formats: &[vk::Format], faults: &mut Faults) {
    for (&(location, _), &is_float) in &outputs.slots {
        let format = formats.get(location as usize).copied().unwrap_or_default();
        if is_float && is_integer(format) {
            return faults.warning(
                "GAURAST-Pipeline-output-type",
                format!(
                    "the fragment shader writes floating point to location {location}, but that colour attachment is \
                     {format:?}: what it stores is undefined"
                ),
            );
        }
    }
}

/// An input that a resolve shader may read.
struct ResolveInput {
    name: &'static str,
    first: u64,
    /// The number of locations.
    count: u64,
    /// The number of components at each.
    components: u32,
    is_float: bool,
}

/// The inputs that the locations name.
fn resolve_inputs(locations: &GaussianResolveInputLocationsGAURAST) -> Vec<ResolveInput> {
    let inputs = [
        ("accumulatedColor", locations.accumulated_color, 1, 4, true),
        ("depth", locations.depth, 1, 2, true),
        ("linearDepth", locations.linear_depth, 1, 2, true),
        ("medianGaussian", locations.median_gaussian, 1, 2, false),
        ("nearestGaussian", locations.nearest_gaussian, 1, 2, false),
        ("firstCamera", locations.first_camera, 6, 4, true),
    ];
    let used = inputs.into_iter().filter(|input| input.1 != UNUSED);
    used.map(|(name, first, count, components, is_float)| ResolveInput {
        name,
        first: first.into(),
        count,
        components,
        is_float,
    })
    .collect()
}

fn place(location: u32) -> String {
    if location == UNUSED { "unused".to_owned() } else { location.to_string() }
}
