//! A dispatch and its expected results.

use ash::vk;
use std::borrow::Cow;

/// A dispatch of a kernel and its expected results.
pub struct Kernel {
    /// Its name.
    pub name: &'static str,
    /// Its SPIR-V, as bytes.
    pub spirv: Cow<'static, [u8]>,
    /// Values of specialization constants, by id.
    pub specialization: Vec<(u32, u32)>,
    /// The initial contents of the buffers of bindings 0, 1 and so on.
    pub buffers: Vec<Vec<u32>>,
    /// The binding that is a uniform buffer, if one is; the others are storage buffers.
    pub uniform: Option<u32>,
    /// Push constants, in words.
    pub push: Vec<u32>,
    /// Workgroups in x, y and z.
    pub groups: [u32; 3],
    /// The results that the host computes.
    pub expected: Vec<Expected>,
}

/// The expected contents of a buffer after one dispatch.
pub struct Expected {
    /// Its binding.
    pub binding: usize,
    /// Its contents.
    pub values: Values,
}

/// Expected words.
pub enum Values {
    /// Exactly these words.
    Exact(Vec<u32>),
    /// Floats within the tolerance times the magnitude of these, or times 1 for smaller magnitudes.
    Close(Vec<f32>, f32),
}

impl Kernel {
    /// The descriptor type of a binding.
    pub fn descriptor_type(&self, binding: u32) -> vk::DescriptorType {
        if self.uniform == Some(binding) {
            vk::DescriptorType::UNIFORM_BUFFER
        } else {
            vk::DescriptorType::STORAGE_BUFFER
        }
    }
}

impl Values {
    /// The first word that differs: its index, and both values as text.
    pub fn difference(&self, found: &[u32]) -> Option<(usize, String)> {
        let differs =
            |index: usize, wanted: String, found: String| Some((index, format!("{found} instead of {wanted}")));
        match self {
            Self::Exact(words) => {
                let index = words.iter().zip(found).position(|(wanted, found)| wanted != found)?;
                differs(index, words[index].to_string(), found[index].to_string())
            }
            Self::Close(floats, tolerance) => {
                let far = |(wanted, found): (&f32, &u32)| {
                    let error = (f32::from_bits(*found) - wanted).abs();
                    // The difference of NaN and a number is never within the tolerance.
                    !matches!(error.partial_cmp(&(tolerance * wanted.abs().max(1.0))), Some(order) if order.is_le())
                };
                let index = floats.iter().zip(found).position(far)?;
                differs(index, floats[index].to_string(), f32::from_bits(found[index]).to_string())
            }
        }
    }
}
