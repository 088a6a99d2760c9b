//! SPIR-V's capabilities: a module may declare those whose features its device has enabled.

use super::features::{EnabledFeatures, is_supported};
use crate::error::Error;
use rspirv::spirv::{Capability, Op};

/// What a capability takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Requirement {
    /// Nothing, in Vulkan 1.3.
    Nothing,
    /// That one of these features is enabled.
    OneOf(&'static [&'static str]),
}

/// What Vulkan's table of capabilities says of one. Those that the translator does not know are its own to refuse.
fn requirement(capability: Capability) -> Requirement {
    use Capability as C;
    Requirement::OneOf(match capability {
        C::Float16 => &["shader_float16"],
        C::Float64 => &["shader_float64"],
        C::Int64 => &["shader_int64"],
        C::Int64Atomics => &["shader_buffer_int64_atomics", "shader_shared_int64_atomics"],
        C::Int16 => &["shader_int16"],
        C::Int8 => &["shader_int8"],
        C::ImageGatherExtended => &["shader_image_gather_extended"],
        C::StorageImageMultisample | C::ImageMSArray => &["shader_storage_image_multisample"],
        C::UniformBufferArrayDynamicIndexing => &["shader_uniform_buffer_array_dynamic_indexing"],
        C::SampledImageArrayDynamicIndexing => &["shader_sampled_image_array_dynamic_indexing"],
        C::StorageBufferArrayDynamicIndexing => &["shader_storage_buffer_array_dynamic_indexing"],
        C::StorageImageArrayDynamicIndexing => &["shader_storage_image_array_dynamic_indexing"],
        C::ClipDistance => &["shader_clip_distance"],
        C::CullDistance => &["shader_cull_distance"],
        C::ImageCubeArray | C::SampledCubeArray => &["image_cube_array"],
        C::SampleRateShading | C::InterpolationFunction => &["sample_rate_shading"],
        C::MinLod => &["shader_resource_min_lod"],
        C::StorageImageExtendedFormats => &["shader_storage_image_extended_formats"],
        C::StorageImageReadWithoutFormat => &["shader_storage_image_read_without_format"],
        C::StorageImageWriteWithoutFormat => &["shader_storage_image_write_without_format"],
        C::MultiViewport => &["multi_viewport"],
        C::ShaderLayer => &["shader_output_layer"],
        C::ShaderViewportIndex => &["shader_output_viewport_index"],
        C::ShaderViewportIndexLayerEXT => &["shader_output_viewport_index", "shader_output_layer"],
        C::DrawParameters => &["shader_draw_parameters"],
        C::StorageBuffer16BitAccess => &["storage_buffer16_bit_access"],
        C::UniformAndStorageBuffer16BitAccess => &["uniform_and_storage_buffer16_bit_access"],
        C::StoragePushConstant16 => &["storage_push_constant16"],
        C::StorageInputOutput16 => &["storage_input_output16"],
        C::StorageBuffer8BitAccess => &["storage_buffer8_bit_access"],
        C::UniformAndStorageBuffer8BitAccess => &["uniform_and_storage_buffer8_bit_access"],
        C::StoragePushConstant8 => &["storage_push_constant8"],
        C::RuntimeDescriptorArray => &["runtime_descriptor_array"],
        C::InputAttachmentArrayDynamicIndexing => {
            &["shader_input_attachment_array_dynamic_indexing"]
        }
        C::UniformTexelBufferArrayDynamicIndexing => {
            &["shader_uniform_texel_buffer_array_dynamic_indexing"]
        }
        C::StorageTexelBufferArrayDynamicIndexing => {
            &["shader_storage_texel_buffer_array_dynamic_indexing"]
        }
        C::UniformBufferArrayNonUniformIndexing => {
            &["shader_uniform_buffer_array_non_uniform_indexing"]
        }
        C::SampledImageArrayNonUniformIndexing => {
            &["shader_sampled_image_array_non_uniform_indexing"]
        }
        C::StorageBufferArrayNonUniformIndexing => {
            &["shader_storage_buffer_array_non_uniform_indexing"]
        }
        C::StorageImageArrayNonUniformIndexing => {
            &["shader_storage_image_array_non_uniform_indexing"]
        }
        C::InputAttachmentArrayNonUniformIndexing => {
            &["shader_input_attachment_array_non_uniform_indexing"]
        }
        C::UniformTexelBufferArrayNonUniformIndexing => {
            &["shader_uniform_texel_buffer_array_non_uniform_indexing"]
        }
        C::StorageTexelBufferArrayNonUniformIndexing => {
            &["shader_storage_texel_buffer_array_non_uniform_indexing"]
        }
        C::PhysicalStorageBufferAddresses => &["buffer_device_address"],
        C::VulkanMemoryModel => &["vulkan_memory_model"],
        C::VulkanMemoryModelDeviceScope => &["vulkan_memory_model_device_scope"],
        C::DemoteToHelperInvocation => &["shader_demote_to_helper_invocation"],
        C::AtomicFloat32AddEXT => &[
            "shader_buffer_float32_atomic_add",
            "shader_shared_float32_atomic_add",
            "shader_image_float32_atomic_add",
        ],
        C::AtomicFloat32MinMaxEXT => &[
            "shader_buffer_float32_atomic_min_max",
            "shader_shared_float32_atomic_min_max",
            "shader_image_float32_atomic_min_max",
        ],
        _ => return Requirement::Nothing,
    })
}

/// The features of which a capability needs one; none if it needs none.
#[cfg(test)]
pub(crate) fn needed(capability: Capability) -> &'static [&'static str] {
    match requirement(capability) {
        Requirement::Nothing => &[],
        Requirement::OneOf(features) => features,
    }
}

/// Refuses a module that declares a capability without its feature.
///
/// # Errors
/// [`Error::FeatureNotEnabled`] names the capability and the feature.
pub(crate) fn check(words: &[u32], features: &EnabledFeatures) -> Result<(), Error> {
    for capability in declared(words) {
        let Requirement::OneOf(needed) = requirement(capability) else {
            continue;
        };
        if needed.iter().any(|feature| features.has(feature)) {
            continue;
        }
        let has = needed.iter().any(|feature| is_supported(feature));
        let what = if has {
            "which is not enabled"
        } else {
            "which this device does not support"
        };
        return Err(Error::FeatureNotEnabled {
            vuid: "VUID-VkShaderModuleCreateInfo-pCode-08740",
            message: format!(
                "the shader module declares the capability {capability:?}, which needs the feature {}, {what}",
                needed.join(" or ")
            ),
        });
    }
    Ok(())
}

/// The capabilities that a module declares. They come first in it; what is malformed is left to those who translate it.
fn declared(words: &[u32]) -> impl Iterator<Item = Capability> {
    const HEADER_WORDS: usize = 5;
    let mut rest = words.get(HEADER_WORDS..).unwrap_or_default();
    std::iter::from_fn(move || {
        let [first, capability, ..] = *rest else {
            return None;
        };
        let is_one = first == 2 << 16 | Op::Capability as u32;
        rest = &rest[2..];
        is_one.then_some(capability)
    })
    .filter_map(Capability::from_u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn module(capabilities: &[Capability]) -> Vec<u32> {
        let mut words = vec![0x0723_0203, 0x0001_0500, 0, 1, 0];
        for &capability in capabilities {
            words.extend([2 << 16 | Op::Capability as u32, capability as u32]);
        }
        // OpMemoryModel Logical GLSL450.
        words.extend([3 << 16 | Op::MemoryModel as u32, 0, 1]);
        words
    }

    #[test]
    fn capabilities_need_their_features() {
        let enabled = EnabledFeatures::of(&["shader_int64", "shader_output_layer"]);
        let check = |capability| check(&module(&[Capability::Shader, capability]), &enabled);
        assert!(check(Capability::Int64).is_ok());
        assert!(check(Capability::ShaderViewportIndexLayerEXT).is_ok());
        assert!(check(Capability::GroupNonUniformArithmetic).is_ok());
        for (capability, words) in [
            (Capability::Float64, "shader_float64, which is not enabled"),
            (
                Capability::PhysicalStorageBufferAddresses,
                "buffer_device_address, which this device does not support",
            ),
        ] {
            let error = check(capability).unwrap_err();
            assert_eq!(error.result(), ash::vk::Result::ERROR_FEATURE_NOT_PRESENT);
            assert!(error.to_string().contains(words), "{error}");
        }
    }

    #[test]
    fn every_capability_that_is_translated_and_supported_can_be_had() {
        let cannot: Vec<_> = (0..0x2000)
            .filter_map(Capability::from_u32)
            .filter(|&capability| crate::shader::is_supported(capability))
            .filter(|&capability| match requirement(capability) {
                Requirement::Nothing => false,
                Requirement::OneOf(needed) => !needed.iter().any(|name| is_supported(name)),
            })
            .collect();
        use Capability as C;
        let expected = [
            C::StorageImageMultisample,
            C::ImageMSArray,
            C::StorageInputOutput16,
            C::InputAttachmentArrayDynamicIndexing,
            C::PhysicalStorageBufferAddresses,
            C::InputAttachmentArrayNonUniformIndexing,
            C::AtomicFloat32AddEXT,
            C::AtomicFloat32MinMaxEXT,
        ];
        for capability in &cannot {
            assert!(expected.contains(capability), "{capability:?}");
        }
        assert_eq!(cannot.len(), expected.len(), "{cannot:?}");
    }

    #[test]
    fn what_is_malformed_declares_nothing() {
        for words in [&[][..], &[0x0723_0203], &[0; 6], &module(&[])[..6]] {
            assert!(check(words, &EnabledFeatures::default()).is_ok());
        }
    }
}
