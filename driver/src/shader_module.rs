//! Shader modules: SPIR-V, kept as words until a pipeline uses it; and the shader stages of pipelines, which are entry
//! points of modules. A module may declare only capabilities that its device has; those that are not enabled are warned of.

use crate::abi::error::Error;
use crate::abi::handle::{self, objects};
use crate::abi::valid;
use crate::device::Device;
use crate::enabled::Enabled;
use crate::instance::device_extension_names;
use crate::physical_device::limits;
use crate::registry::features::{Features, SUPPORTED};
use crate::registry::spirv::{Enable, enables};
use ash::vk;
use gaurast_spirv::{Module, Options, Shader, Specialization, Stage, is_supported, translate};
use simdevice::host;
use spirv::{Capability, Op};
use std::ffi::CStr;
use std::sync::{Arc, Mutex, PoisonError};

/// The first word of a SPIR-V module.
const MAGIC: u32 = 0x0723_0203;

/// A shader module.
#[derive(Debug)]
pub(crate) struct ShaderModule {
    /// Its SPIR-V.
    words: Box<[u32]>,
}

objects! { vk::ShaderModule => ShaderModule; }

impl ShaderModule {
    /// Keeps a copy of SPIR-V.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if it isn't SPIR-V in the host's byte order; otherwise as [`check_capabilities`].
    fn new(words: &[u32], enabled: &Enabled) -> Result<Self, Error> {
        if words.first() != Some(&MAGIC) {
            return Err(Error::usage("VUID-VkShaderModuleCreateInfo-pCode-08738", "the code is not SPIR-V"));
        }
        check_capabilities(words, enabled)?;
        Ok(Self { words: host::boxed(words) })
    }

    /// Translates an entry point for the device.
    ///
    /// # Errors
    /// [`Error::InvalidShader`] names the instruction that is malformed or not supported.
    fn translate(
        &self,
        name: &str,
        stage: Stage,
        specialization: &Specialization,
        options: &Options,
    ) -> Result<Shader, Error> {
        Module::parse(&self.words)
            .and_then(|module| translate(&module, name, stage, specialization, options))
            .map_err(|error| Error::InvalidShader(error.to_string()))
    }
}

/// Checks that a module declares only capabilities that the device has, and warns of those that are not enabled.
/// Capabilities that the translator doesn't know are left for it to refuse.
///
/// # Errors
/// [`Error::FeatureNotEnabled`] names a capability that the device lacks, and the features or extensions that enable it;
/// on a strict device also one that is not enabled.
fn check_capabilities(words: &[u32], enabled: &Enabled) -> Result<(), Error> {
    for capability in declared(words).filter(|&capability| is_supported(capability)) {
        if !is_enabled(capability, &SUPPORTED, device_extension_names()) {
            return Err(not_enabled(capability, "which this device does not support"));
        }
        let is_enabled = is_enabled(capability, enabled.features(), enabled.extensions());
        enabled.require(is_enabled, || not_enabled(capability, "which is not enabled"))?;
    }
    Ok(())
}

/// Reports whether one of the features or extensions that enable a capability is enabled.
fn is_enabled(capability: Capability, features: &Features, extensions: &[&CStr]) -> bool {
    let enables = enables(capability);
    enables.is_empty()
        || enables.iter().any(|enable| match enable {
            Enable::Feature(name) => features.has(name),
            Enable::Property(_, is_there) => is_there(limits::properties()),
            Enable::Extension(name) => extensions.contains(name),
            Enable::Absent(_) => false,
        })
}

/// The error of a capability whose features are absent, in the way that `how` says.
fn not_enabled(capability: Capability, how: &str) -> Error {
    // Things that the device doesn't support are named only if it supports none.
    let known: Vec<_> = enables(capability)
        .iter()
        .filter_map(|enable| match enable {
            Enable::Feature(name) | Enable::Property(name, _) => Some(*name),
            Enable::Extension(_) | Enable::Absent(_) => None,
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
    Error::FeatureNotEnabled {
        vuid: "VUID-VkShaderModuleCreateInfo-pCode-08740",
        message: format!(
            "the shader module declares the capability {capability:?}, which needs the feature {}, {how}",
            needed.join(" or ")
        ),
    }
}

/// The capabilities that a module declares, which come first in it. Malformed words are left for the translator to
/// refuse.
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

/// A shader stage of a pipeline.
#[derive(Clone, Debug)]
pub(crate) struct ShaderStage {
    /// The shader module.
    module: Arc<ShaderModule>,
    /// The entry point's name.
    pub(crate) name: String,
    /// Values of specialization constants.
    specialization: Specialization,
    /// The subgroup size that the stage requires.
    pub(crate) required_subgroup_size: Option<u32>,
    /// True if the index of a view is that of the device, which is 0.
    pub(crate) view_is_device: bool,
    /// The last translation of a library's stage, with its options; `None` for a stage of a pipeline.
    translated: Option<Arc<Mutex<Translation>>>,
}

/// A shader and the options that it was translated with; `None` before the first translation.
type Translation = Option<(Options, Shader)>;

impl ShaderStage {
    /// The stage of a create info.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] for an invalid name or subgroup size, or if there is no module; and the errors of
    /// [`ShaderModule::new`] if the create info has the module's code.
    ///
    /// # Safety
    /// The create info and its chain are valid.
    pub(crate) unsafe fn from_create_info(
        device: &Device,
        info: &vk::PipelineShaderStageCreateInfo<'_>,
    ) -> Result<Self, Error> {
        // SAFETY: the caller's promise.
        unsafe {
            let name = valid::string(info.p_name).ok_or(Error::NullPointer { what: "an entry point's name" })?;
            let name = name.to_str().map_err(|_| {
                Error::usage(
                    "VUID-VkPipelineShaderStageCreateInfo-pName-parameter",
                    "the entry point's name is not UTF-8",
                )
            })?;
            let required =
                valid::find_in_chain::<vk::PipelineShaderStageRequiredSubgroupSizeCreateInfo<'_>>(info.p_next);
            Ok(Self {
                module: module(device, info)?,
                name: name.to_owned(),
                specialization: specialization(valid::optional(info.p_specialization_info))?,
                required_subgroup_size: required.map(subgroup_size).transpose()?,
                view_is_device: false,
                translated: None,
            })
        }
    }

    /// Makes the stage one of a library, of which translations are kept. Returns false if it is one already.
    pub(crate) fn keep_translations(&mut self) -> bool {
        let is_new = self.translated.is_none();
        self.translated.get_or_insert_default();
        is_new
    }

    /// The stage's shader, which is translated unless the last translation of a library's stage had the same options.
    ///
    /// # Errors
    /// [`Error::InvalidShader`] names the instruction that is malformed or not supported.
    pub(crate) fn translate(&self, kind: Stage, options: &Options) -> Result<Shader, Error> {
        let new = || {
            let (name, constants) = (&self.name, &self.specialization);
            self.module.translate(name, kind, constants, options)
        };
        let Some(last) = &self.translated else {
            return new();
        };
        let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
        match &*last {
            Some((of, shader)) if of == options => Ok(shader.clone()),
            _ => {
                let shader = new()?;
                *last = Some((*options, shader.clone()));
                Ok(shader)
            }
        }
    }
}

/// The module of a stage: the one that it names, or else that of the code in its chain.
///
/// # Safety
/// The create info and its chain are valid.
unsafe fn module(device: &Device, info: &vk::PipelineShaderStageCreateInfo<'_>) -> Result<Arc<ShaderModule>, Error> {
    // SAFETY: the caller's promise.
    unsafe {
        if let Some(module) = handle::get_optional(info.module)? {
            return Ok(Arc::clone(module));
        }
        let features = device.features();
        device.enabled().require(features.graphics_pipeline_library || features.maintenance5, || {
            Error::usage(
                "VUID-VkPipelineShaderStageCreateInfo-stage-08771",
                "module is VK_NULL_HANDLE, and neither graphicsPipelineLibrary nor maintenance5 is enabled",
            )
        })?;
        let code = valid::find_in_chain::<vk::ShaderModuleCreateInfo<'_>>(info.p_next);
        let code = code.ok_or_else(|| {
            Error::usage(
                "VUID-VkPipelineShaderStageCreateInfo-stage-06845",
                "module is VK_NULL_HANDLE, and the stage's chain has no VkShaderModuleCreateInfo",
            )
        })?;
        create_shader_module(device, code)
    }
}

fn subgroup_size(required: &vk::PipelineShaderStageRequiredSubgroupSizeCreateInfo<'_>) -> Result<u32, Error> {
    let size = required.required_subgroup_size;
    if size.is_power_of_two() && limits::SUBGROUP_SIZES.contains(&size) {
        return Ok(size);
    }
    Err(Error::usage(
        "VUID-VkPipelineShaderStageRequiredSubgroupSizeCreateInfo-requiredSubgroupSize-02760",
        format!("the subgroup size {size} is not a power of two in {:?}", limits::SUBGROUP_SIZES),
    ))
}

/// The values of specialization constants.
///
/// # Safety
/// The specialization info is valid.
unsafe fn specialization(info: Option<&vk::SpecializationInfo<'_>>) -> Result<Specialization, Error> {
    let mut specialization = Specialization::default();
    let Some(info) = info else {
        return Ok(specialization);
    };
    let size = u32::try_from(info.data_size).unwrap_or(u32::MAX);
    // SAFETY: the caller's promise.
    let (data, entries) = unsafe {
        (valid::slice(info.p_data.cast::<u8>(), size)?, valid::slice(info.p_map_entries, info.map_entry_count)?)
    };
    for entry in entries {
        let offset = entry.offset as usize;
        let end = offset.checked_add(entry.size);
        let bytes = end.and_then(|end| data.get(offset..end)).ok_or_else(|| {
            Error::usage(
                "VUID-VkSpecializationInfo-pMapEntries-00774",
                format!(
                    "the value of specialization constant {} lies outside the {size} bytes given",
                    entry.constant_id
                ),
            )
        })?;
        specialization.set(entry.constant_id, bytes);
    }
    Ok(specialization)
}

/// # Safety
/// The create info is valid.
#[doc(alias = "vkCreateShaderModule")]
pub(crate) unsafe fn create_shader_module(
    device: &Device,
    create_info: &vk::ShaderModuleCreateInfo<'_>,
) -> Result<Arc<ShaderModule>, Error> {
    let words = u32::try_from(create_info.code_size / 4).unwrap_or(0);
    // SAFETY: the caller's promise.
    let words = unsafe { valid::slice(create_info.p_code, words)? };
    ShaderModule::new(words, device.enabled()).map(Arc::new)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instance::device_extension_names;
    use std::collections::HashSet;

    fn module(capabilities: &[Capability]) -> Vec<u32> {
        let mut words = vec![0x0723_0203, 0x0001_0500, 0, 1, 0];
        for &capability in capabilities {
            words.extend([2 << 16 | Op::Capability as u32, capability as u32]);
        }
        // The words of `OpMemoryModel Logical GLSL450`.
        words.extend([3 << 16 | Op::MemoryModel as u32, 0, 1]);
        words
    }

    #[test]
    fn capabilities_need_their_features() {
        let enabled = Features { shader_int64: true, shader_output_layer: true, ..Features::NONE };
        let enabled = Enabled::strict_with(enabled, &[]);
        let check = |capability| check_capabilities(&module(&[Capability::Shader, capability]), &enabled);
        assert!(check(Capability::Int64).is_ok());
        assert!(check(Capability::ShaderViewportIndexLayerEXT).is_ok());
        assert!(check(Capability::GroupNonUniformArithmetic).is_ok());
        for (capability, words) in [
            (Capability::Float64, "shaderFloat64, which is not enabled"),
            (Capability::PhysicalStorageBufferAddresses, "bufferDeviceAddress, which is not enabled"),
        ] {
            let error = check(capability).unwrap_err();
            assert_eq!(error.result(), vk::Result::ERROR_FEATURE_NOT_PRESENT);
            assert!(error.to_string().contains(words), "{error}");
        }
        let lacking = check(Capability::StorageInputOutput16).unwrap_err().to_string();
        assert!(lacking.contains("storageInputOutput16, which this device does not support"), "{lacking}");
    }

    #[test]
    fn capabilities_name_features_that_there_are() {
        let names: HashSet<_> = SUPPORTED.list().map(|(name, _)| name).collect();
        let enables = (0..0x2000).filter_map(Capability::from_u32).flat_map(enables);
        let mut features =
            enables.filter_map(|enable| if let Enable::Feature(name) = enable { Some(name) } else { None });
        assert!(features.clone().count() > 50);
        assert_eq!(features.find(|&&name| !names.contains(name)), None);
    }

    #[test]
    fn every_capability_that_is_translated_and_supported_can_be_had() {
        let extensions = device_extension_names();
        let cannot: Vec<_> = (0..0x2000)
            .filter_map(Capability::from_u32)
            .filter(|&capability| is_supported(capability))
            .filter(|&capability| !is_enabled(capability, &SUPPORTED, extensions))
            .collect();
        use Capability as C;
        let expected = [
            C::StorageInputOutput16,
            C::InputAttachmentArrayDynamicIndexing,
            C::InputAttachmentArrayNonUniformIndexing,
        ];
        for capability in &cannot {
            assert!(expected.contains(capability), "{capability:?}");
        }
        assert_eq!(cannot.len(), expected.len(), "{cannot:?}");
    }

    #[test]
    fn what_is_malformed_declares_nothing() {
        for words in [&[][..], &[0x0723_0203], &[0; 6], &module(&[])[..6]] {
            assert!(check_capabilities(words, &Enabled::strict()).is_ok());
        }
    }
}
