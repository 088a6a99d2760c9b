//! Shader modules: SPIR-V, kept as words until a pipeline is made of it.

use crate::capabilities::spirv;
use crate::error::Error;
use crate::registry::features::Features;
use gaurast_spirv::{self as shader, Module, Options, Shader, Specialization, Stage};
use simdevice::host;

/// The first word of SPIR-V.
const MAGIC: u32 = 0x0723_0203;

/// A shader module.
#[derive(Debug)]
pub(crate) struct ShaderModule {
    /// Its SPIR-V.
    words: Box<[u32]>,
}

crate::objects! { ash::vk::ShaderModule => ShaderModule; }

impl ShaderModule {
    /// Keeps a copy of SPIR-V.
    ///
    /// # Errors
    /// [`Error::Usage`] if it isn't SPIR-V in the host's byte order; [`Error::FeatureNotEnabled`] if it declares a capability
    /// whose feature isn't enabled.
    pub(crate) fn new(words: &[u32], features: &Features) -> Result<Self, Error> {
        if words.first() != Some(&MAGIC) {
            return Err(Error::usage(
                "VUID-VkShaderModuleCreateInfo-pCode-08738",
                "the code is not SPIR-V",
            ));
        }
        spirv::check(words, features)?;
        Ok(Self {
            words: host::boxed(words),
        })
    }

    /// Translates an entry point for the device.
    ///
    /// # Errors
    /// [`Error::InvalidShader`] names the instruction that is malformed or not supported.
    pub(crate) fn translate(
        &self,
        name: &str,
        stage: Stage,
        specialization: &Specialization,
        options: &Options,
    ) -> Result<Shader, Error> {
        Module::parse(&self.words)
            .and_then(|module| shader::translate(&module, name, stage, specialization, options))
            .map_err(|error| Error::InvalidShader(error.to_string()))
    }
}
