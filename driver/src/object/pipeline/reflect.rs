//! What shaders want of a pipeline, compared with what its layout gives.
//!
//! Everything here follows from the [`Interface`] that translation leaves, so reflection and execution can't disagree.
//! The spirv-reflect crate isn't used at run time. Its C code aborts the process by assertions, on malformed modules
//! and also on valid ones of SPIR-V 1.4 and later, whose entry points list their buffers; and its bindings make slices
//! from null pointers where a list is empty, which aborts debug builds in nearly all that enumerates. What is left (the
//! name and stage of the first entry point, of modules that are known to be good) serves as a second opinion in a test.

use std::collections::HashMap;

use gaurast_spirv::{
    DescriptorKind, InputSource, Interface, OutputTarget, ScalarType, ShaderBinding, Stage,
};
use thiserror::Error;

/// A binding of a descriptor set layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LayoutBinding {
    /// The descriptor set.
    pub set: u32,
    /// The binding in it.
    pub binding: u32,
    /// What descriptors it holds. Dynamic buffers count as the ordinary ones.
    pub kind: DescriptorKind,
    /// How many.
    pub count: u32,
    /// Whether the stage may use it.
    pub visible: bool,
}

/// A range of push constants, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PushConstantRange {
    /// The first byte.
    pub offset: u32,
    /// How many.
    pub size: u32,
    /// Whether the stage may use it.
    pub visible: bool,
}

/// A pipeline layout as one stage sees it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Layout {
    /// All bindings of all sets.
    pub bindings: Vec<LayoutBinding>,
    /// All ranges of push constants.
    pub push_constants: Vec<PushConstantRange>,
}

/// A disagreement between a shader and what surrounds it.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum Mismatch {
    /// The layout has no such binding.
    #[error(
        "the {stage} shader uses set {set}, binding {binding}{name}, which the pipeline layout doesn't have"
    )]
    NoBinding {
        /// The shader's stage.
        stage: Stage,
        /// The set.
        set: u32,
        /// The binding.
        binding: u32,
        /// The variable's name.
        name: Name,
    },
    /// The binding isn't for this stage.
    #[error(
        "set {set}, binding {binding}{name} of the pipeline layout isn't visible to the {stage} stage"
    )]
    NotVisible {
        /// The shader's stage.
        stage: Stage,
        /// The set.
        set: u32,
        /// The binding.
        binding: u32,
        /// The variable's name.
        name: Name,
    },
    /// The binding holds other descriptors.
    #[error(
        "set {set}, binding {binding}{name} is a {wanted:?} in the {stage} shader, but a {given:?} in the pipeline layout"
    )]
    Kind {
        /// The shader's stage.
        stage: Stage,
        /// The set.
        set: u32,
        /// The binding.
        binding: u32,
        /// The variable's name.
        name: Name,
        /// What the shader wants.
        wanted: DescriptorKind,
        /// What the layout gives.
        given: DescriptorKind,
    },
    /// The binding is too short.
    #[error(
        "set {set}, binding {binding}{name} has {given} descriptors in the pipeline layout; the {stage} shader wants {wanted}"
    )]
    Count {
        /// The shader's stage.
        stage: Stage,
        /// The set.
        set: u32,
        /// The binding.
        binding: u32,
        /// The variable's name.
        name: Name,
        /// What the shader wants.
        wanted: u32,
        /// What the layout gives.
        given: u32,
    },
    /// Push constants that the layout doesn't have.
    #[error(
        "the {stage} shader uses push constants {begin} to {end}, which no range of the pipeline layout covers"
    )]
    PushConstants {
        /// The shader's stage.
        stage: Stage,
        /// The first byte.
        begin: u32,
        /// Past the last byte.
        end: u32,
    },
    /// A vertex attribute that the pipeline doesn't describe.
    #[error(
        "the vertex shader reads location {location}, for which the pipeline has no vertex attribute"
    )]
    NoAttribute {
        /// The location.
        location: u32,
    },
    /// A vertex attribute whose format is of another kind.
    #[error(
        "the vertex shader reads location {location} as {wanted:?}, but the attribute's format is {given:?}"
    )]
    AttributeType {
        /// The location.
        location: u32,
        /// What the shader reads.
        wanted: ScalarType,
        /// What the format gives.
        given: ScalarType,
    },
    /// An input that the stage before doesn't write.
    #[error(
        "the fragment shader reads location {location}, component {component}, which the vertex shader doesn't write"
    )]
    NoOutput {
        /// The location.
        location: u32,
        /// The component.
        component: u32,
    },
}

/// A variable's name in a message, if it has one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Name(pub Option<String>);

impl std::fmt::Display for Name {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.0 {
            Some(name) => write!(f, " (\"{name}\")"),
            None => Ok(()),
        }
    }
}

/// Compares what a shader is bound to with a pipeline layout.
pub fn check(interface: &Interface, layout: &Layout) -> Vec<Mismatch> {
    let bindings: HashMap<(u32, u32), &LayoutBinding> = layout
        .bindings
        .iter()
        .map(|it| ((it.set, it.binding), it))
        .collect();
    let mut found: Vec<Mismatch> = interface
        .descriptors
        .iter()
        .filter_map(|it| {
            let given = bindings.get(&(it.set, it.binding)).copied();
            check_descriptor(interface.stage, it, given)
        })
        .collect();
    if let Some(wanted) = &interface.push_constants
        && !covers(&layout.push_constants, wanted.start, wanted.end)
    {
        found.push(Mismatch::PushConstants {
            stage: interface.stage,
            begin: wanted.start,
            end: wanted.end,
        });
    }
    found
}

fn check_descriptor(
    stage: Stage,
    wanted: &ShaderBinding,
    given: Option<&LayoutBinding>,
) -> Option<Mismatch> {
    let (set, binding, name) = (wanted.set, wanted.binding, Name(wanted.name.clone()));
    let Some(given) = given else {
        return Some(Mismatch::NoBinding {
            stage,
            set,
            binding,
            name,
        });
    };
    if !given.visible {
        return Some(Mismatch::NotVisible {
            stage,
            set,
            binding,
            name,
        });
    }
    // A combined descriptor may serve as either of its parts.
    let parts = matches!(
        (wanted.kind, given.kind),
        (
            DescriptorKind::SampledImage | DescriptorKind::Sampler,
            DescriptorKind::CombinedImageSampler
        )
    );
    if wanted.kind != given.kind && !parts {
        return Some(Mismatch::Kind {
            stage,
            set,
            binding,
            name,
            wanted: wanted.kind,
            given: given.kind,
        });
    }
    (wanted.count > given.count).then_some(Mismatch::Count {
        stage,
        set,
        binding,
        name,
        wanted: wanted.count,
        given: given.count,
    })
}

/// Whether visible ranges cover all bytes.
fn covers(ranges: &[PushConstantRange], begin: u32, end: u32) -> bool {
    let mut visible: Vec<(u32, u32)> = ranges
        .iter()
        .filter(|range| range.visible)
        .map(|range| (range.offset, range.offset.saturating_add(range.size)))
        .collect();
    visible.sort_unstable();
    let mut covered = begin;
    for (first, last) in visible {
        if first <= covered {
            covered = covered.max(last);
        }
    }
    covered >= end
}

/// A vertex attribute that the pipeline describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attribute {
    /// The location that it feeds.
    pub location: u32,
    /// What the components of its format are read as; normalised and scaled formats are floats.
    pub numeric: ScalarType,
}

/// Compares what a vertex shader reads with the pipeline's vertex attributes.
pub fn check_attributes(interface: &Interface, attributes: &[Attribute]) -> Vec<Mismatch> {
    let mut found = Vec::new();
    for (location, wanted) in interface.locations_read() {
        // 64-bit vectors of three or four components go on in the next location.
        let given = attributes.iter().find(|it| {
            let spans = if is_wide(it.numeric) { 2 } else { 1 };
            (it.location..it.location.saturating_add(spans)).contains(&location)
        });
        match given {
            None => found.push(Mismatch::NoAttribute { location }),
            Some(given) if class(given.numeric) != class(wanted) => {
                found.push(Mismatch::AttributeType {
                    location,
                    wanted,
                    given: given.numeric,
                });
            }
            Some(_) => {}
        }
    }
    found
}

/// Compares what a fragment shader reads with what the stage before writes.
pub fn check_stages(before: &Interface, fragment: &Interface) -> Vec<Mismatch> {
    let written = |location: u32, component: u32| {
        before.outputs.iter().any(|output| {
            matches!(output.target, OutputTarget::Location { location: at, component: part, .. }
                if (at, part) == (location, component))
        })
    };
    let mut found: Vec<Mismatch> = fragment
        .inputs
        .iter()
        .filter_map(|input| match input.source {
            InputSource::Location {
                location,
                component,
                ..
            } if !written(location, component) => Some(Mismatch::NoOutput {
                location,
                component,
            }),
            _ => None,
        })
        .collect();
    found.dedup();
    found
}

fn is_wide(numeric: ScalarType) -> bool {
    matches!(
        numeric,
        ScalarType::Float { width: 64 }
            | ScalarType::Int { width: 64 }
            | ScalarType::Uint { width: 64 }
    )
}

/// What must agree between a format and an input: the kind of number and whether it has 64 bits.
fn class(numeric: ScalarType) -> (u8, bool) {
    let kind = match numeric {
        ScalarType::Float { .. } => 0,
        ScalarType::Int { .. } => 1,
        ScalarType::Uint { .. } | ScalarType::Bool => 2,
    };
    (kind, is_wide(numeric))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gaurast_spirv::{Module, Options, Specialization, translate};
    use std::path::Path;

    const FLOAT: ScalarType = ScalarType::Float { width: 32 };

    /// The interface of a shader that is kept for the tests of the translation.
    fn interface(name: &str, stage: Stage) -> Interface {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("spirv/tests/shaders");
        let bytes = std::fs::read(folder.join(format!("{name}.spv"))).unwrap();
        let words: Vec<u32> = bytes
            .chunks_exact(4)
            .map(|word| u32::from_le_bytes(word.try_into().unwrap()))
            .collect();
        let (specialization, options) = (Specialization::default(), Options::default());
        let module = Module::parse(&words).unwrap();
        let shader = translate(&module, "main", stage, &specialization, &options).unwrap();
        shader.interface
    }

    #[test]
    fn disagreements_with_the_layout_are_told() {
        let found = interface("descriptor_arrays.comp", Stage::Compute);
        let binding = |set, binding, kind, count| LayoutBinding {
            set,
            binding,
            kind,
            count,
            visible: true,
        };
        let fits = Layout {
            bindings: vec![
                binding(0, 2, DescriptorKind::StorageBuffer, 1),
                binding(1, 3, DescriptorKind::StorageBuffer, 4),
            ],
            push_constants: Vec::new(),
        };
        assert_eq!(check(&found, &fits), []);
        let mut other = fits;
        other.bindings[0].kind = DescriptorKind::UniformBuffer;
        other.bindings[1].count = 2;
        let told: Vec<String> = check(&found, &other)
            .iter()
            .map(ToString::to_string)
            .collect();
        assert_eq!(
            told,
            [
                "set 0, binding 2 (\"Out\") is a StorageBuffer in the compute shader, but a UniformBuffer in the \
                 pipeline layout",
                "set 1, binding 3 (\"buffers\") has 2 descriptors in the pipeline layout; the compute shader wants 4",
            ]
        );
        other.bindings[0].visible = false;
        other.bindings.pop();
        let told: Vec<String> = check(&found, &other)
            .iter()
            .map(ToString::to_string)
            .collect();
        assert_eq!(
            told,
            [
                "set 0, binding 2 (\"Out\") of the pipeline layout isn't visible to the compute stage",
                "the compute shader uses set 1, binding 3 (\"buffers\"), which the pipeline layout doesn't have",
            ]
        );
    }

    #[test]
    fn push_constants_attributes_and_stages_are_compared() {
        let vertex = interface("triangle.vert", Stage::Vertex);
        let range = |offset, size| PushConstantRange {
            offset,
            size,
            visible: true,
        };
        let with = |push_constants| Layout {
            bindings: Vec::new(),
            push_constants,
        };
        assert_eq!(check(&vertex, &with(vec![range(0, 40), range(40, 40)])), []);
        assert_eq!(check(&vertex, &with(vec![range(0, 64)])).len(), 1);
        let attribute = |location, numeric| Attribute { location, numeric };
        assert_eq!(
            check_attributes(&vertex, &[attribute(0, FLOAT), attribute(1, FLOAT)]),
            []
        );
        let uint = ScalarType::Uint { width: 8 };
        assert_eq!(check_attributes(&vertex, &[attribute(0, uint)]).len(), 2);
        let fragment = interface("textured.frag", Stage::Fragment);
        let missing = check_stages(&vertex, &fragment);
        assert_eq!(
            missing.len(),
            4,
            "uv, layer and fog aren't written: {missing:?}"
        );
    }
}
