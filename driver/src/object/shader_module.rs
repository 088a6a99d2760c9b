//! Shader modules: SPIR-V, kept as words until a pipeline is made of it.

use crate::error::Error;

/// The first word of SPIR-V.
const MAGIC: u32 = 0x0723_0203;

/// A shader module.
#[derive(Debug)]
pub(crate) struct ShaderModule {
    /// Its SPIR-V.
    #[allow(dead_code, reason = "no pipeline has a shader stage yet")]
    words: Box<[u32]>,
}

crate::objects! { ash::vk::ShaderModule => ShaderModule; }

impl ShaderModule {
    /// Keeps a copy of SPIR-V.
    ///
    /// # Errors
    /// [`Error::Usage`] if it isn't SPIR-V in the host's byte order.
    pub(crate) fn new(words: &[u32]) -> Result<Self, Error> {
        if words.first() != Some(&MAGIC) {
            return Err(Error::usage(
                "VUID-VkShaderModuleCreateInfo-pCode-08738",
                "the code is not SPIR-V",
            ));
        }
        Ok(Self {
            words: words.into(),
        })
    }
}
