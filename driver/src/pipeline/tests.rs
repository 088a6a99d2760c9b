//! Tests that shaders are compared with the pipeline's layout, its vertex attributes and the stage before.

use super::layout::PipelineLayout;
use super::{link, stages};
use crate::descriptor::layout::{BindingInfo, DescriptorSetLayout};
use ash::vk;
use gaurast_spirv::{Interface, Module, Options, Specialization, Stage, translate};
use simdevice::Format;
use std::path::Path;
use std::sync::Arc;

/// The interface of a checked-in shader of the shader compiler's tests.
fn interface(name: &str, stage: Stage) -> Interface {
    translated(name, stage, &Options::default())
}

/// The interface of a shader that is translated with these options.
fn translated(name: &str, stage: Stage, options: &Options) -> Interface {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("spirv/tests/shaders");
    let bytes = std::fs::read(folder.join(format!("{name}.spv"))).unwrap();
    let words: Vec<u32> = bytes.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().unwrap())).collect();
    let specialization = Specialization::default();
    let module = Module::parse(&words).unwrap();
    let shader = translate(&module, "main", stage, &specialization, options).unwrap();
    shader.interface
}

/// A binding that all stages can access.
fn binding(number: u32, kind: vk::DescriptorType, count: u32) -> BindingInfo {
    BindingInfo {
        number,
        kind,
        count,
        stages: vk::ShaderStageFlags::ALL,
        immutable_samplers: Vec::new(),
        flags: vk::DescriptorBindingFlags::empty(),
    }
}

/// A layout of sets with a binding each.
fn layout(sets: Vec<BindingInfo>) -> PipelineLayout {
    let set = |info| {
        Some(Arc::new(DescriptorSetLayout::new(vec![info], vk::DescriptorSetLayoutCreateFlags::empty()).unwrap()))
    };
    PipelineLayout::new(sets.into_iter().map(set).collect(), &[], 0).unwrap()
}

#[test]
fn disagreements_with_the_layout_are_told() {
    let found = interface("descriptor_arrays.comp", Stage::Compute);
    let (storage, uniform) = (vk::DescriptorType::STORAGE_BUFFER, vk::DescriptorType::UNIFORM_BUFFER);
    let fits = layout(vec![binding(2, storage, 1), binding(3, storage, 4)]);
    assert_eq!(fits.mismatches(&found), [""; 0]);
    let other = layout(vec![binding(2, uniform, 1), binding(3, storage, 2)]);
    assert_eq!(
        other.mismatches(&found),
        [
            "set 0, binding 2 (\"Out\") is a StorageBuffer in the compute shader, but a UniformBuffer in the \
             pipeline layout",
            "set 1, binding 3 (\"buffers\") has 2 descriptors in the pipeline layout; the compute shader wants 4",
        ]
    );
    let invisible = BindingInfo { stages: vk::ShaderStageFlags::VERTEX, ..binding(2, uniform, 1) };
    assert_eq!(
        layout(vec![invisible]).mismatches(&found),
        [
            "set 0, binding 2 (\"Out\") of the pipeline layout isn't visible to the compute stage",
            "the compute shader uses set 1, binding 3 (\"buffers\"), which the pipeline layout doesn't have",
        ]
    );
}

#[test]
fn arrays_without_a_length_take_what_the_layout_has() {
    let options = Options { unsized_descriptors: 5, ..Options::default() };
    let found = translated("unsized_descriptors.comp", Stage::Compute, &options);
    let storage = vk::DescriptorType::STORAGE_BUFFER;
    for count in [1, 7] {
        let sources = binding(0, storage, count);
        let layout = PipelineLayout::new(
            vec![Some(Arc::new(
                DescriptorSetLayout::new(
                    vec![sources, binding(1, storage, 1)],
                    vk::DescriptorSetLayoutCreateFlags::empty(),
                )
                .unwrap(),
            ))],
            &[],
            0,
        )
        .unwrap();
        assert_eq!(layout.mismatches(&found), [""; 0]);
    }
}

#[test]
fn push_constants_attributes_and_stages_are_compared() {
    let vertex = interface("triangle.vert", Stage::Vertex);
    let with = |ranges: &[(u32, u32)]| {
        let range = |&(offset, size): &(u32, u32)| vk::PushConstantRange {
            stage_flags: vk::ShaderStageFlags::ALL,
            offset,
            size,
        };
        let ranges: Vec<_> = ranges.iter().map(range).collect();
        PipelineLayout::new(Vec::new(), &ranges, 128).unwrap()
    };
    let covering = with(&[(0, 40), (40, 40)]);
    assert_eq!(covering.mismatches(&vertex), [""; 0]);
    assert_eq!(with(&[(0, 64)]).mismatches(&vertex).len(), 1);

    let read = vertex.locations_read();
    assert_eq!(read.len(), 2);
    let mismatches = |format| {
        let of = |&(location, wanted)| stages::type_mismatch(location, wanted, format);
        read.iter().filter_map(of).count()
    };
    assert_eq!(mismatches(Format::R32G32B32A32Sfloat), 0);
    assert_eq!(mismatches(Format::R8G8B8A8Uint), 2);

    let fragment = interface("textured.frag", Stage::Fragment);
    let missing = link::unwritten(&vertex, &fragment);
    assert_eq!(missing.len(), 4, "uv, layer and fog aren't written: {missing:?}");
}
