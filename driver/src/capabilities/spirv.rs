//! SPIR-V's capabilities: a module may declare those that its device has enabled.

use crate::capabilities::limits;
use crate::error::Error;
use crate::registry::features::{Features, SUPPORTED};
use crate::registry::spirv::{Enable, enables};
use spirv::{Capability, Op};

/// Refuses a module that declares a capability that isn't enabled. Capabilities that the translator doesn't know are its
/// own to refuse.
///
/// # Errors
/// [`Error::FeatureNotEnabled`] names the capability and what would enable it.
pub(crate) fn check(words: &[u32], features: &Features) -> Result<(), Error> {
    match declared(words)
        .filter(|&capability| gaurast_spirv::is_supported(capability))
        .find(|&capability| !is_enabled(capability, features))
    {
        None => Ok(()),
        Some(capability) => Err(not_enabled(capability)),
    }
}

/// Tells if one of the things that enable a capability is there.
fn is_enabled(capability: Capability, features: &Features) -> bool {
    let enables = enables(capability);
    enables.is_empty()
        || enables.iter().any(|enable| match enable {
            Enable::Feature(_, is_enabled) => is_enabled(features),
            Enable::Property(_, is_there) => is_there(limits::properties()),
            Enable::Absent(_) => false,
        })
}

fn not_enabled(capability: Capability) -> Error {
    // What the device doesn't know is of interest only where nothing else would do.
    let known: Vec<_> = enables(capability)
        .iter()
        .filter_map(|enable| match enable {
            Enable::Feature(name, _) | Enable::Property(name, _) => Some(*name),
            Enable::Absent(_) => None,
        })
        .collect();
    let absent: Vec<_> = enables(capability)
        .iter()
        .filter_map(|enable| match enable {
            Enable::Absent(name) => Some(*name),
            _ => None,
        })
        .collect();
    let needed = if known.is_empty() { absent } else { known };
    let what = if is_enabled(capability, &SUPPORTED) {
        "which is not enabled"
    } else {
        "which this device does not support"
    };
    Error::FeatureNotEnabled {
        vuid: "VUID-VkShaderModuleCreateInfo-pCode-08740",
        message: format!(
            "the shader module declares the capability {capability:?}, which needs the feature {}, {what}",
            needed.join(" or ")
        ),
    }
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
        let enabled = Features {
            shader_int64: true,
            shader_output_layer: true,
            ..Features::NONE
        };
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
            .filter(|&capability| gaurast_spirv::is_supported(capability))
            .filter(|&capability| !is_enabled(capability, &SUPPORTED))
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
            assert!(check(words, &Features::NONE).is_ok());
        }
    }
}
