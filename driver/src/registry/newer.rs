//! Structures and commands of the registry that are newer than ash. The generator reads them as it reads ash.

use ash::vk::{Bool32, CommandBuffer, StructureType, TaggedStructure};
use std::ffi::c_void;

/// Gives a structure its type.
macro_rules! tagged {
    ($($structure:ident = $number:literal;)*) => {
        $(
            // SAFETY: the structure has the members of the registry's, in their order, and this is its type there.
            unsafe impl TaggedStructure for $structure {
                const STRUCTURE_TYPE: StructureType = StructureType::from_raw($number);
            }
        )*
    };
}

tagged! {
    PhysicalDeviceUnifiedImageLayoutsFeaturesKHR = 1_000_527_000;
    PhysicalDeviceShaderRelaxedExtendedInstructionFeaturesKHR = 1_000_558_000;
    PhysicalDeviceShaderReplicatedCompositesFeaturesEXT = 1_000_564_000;
    PhysicalDeviceZeroInitializeDeviceMemoryFeaturesEXT = 1_000_620_000;
    PhysicalDevicePrimitiveRestartIndexFeaturesEXT = 1_000_678_000;
}

/// `VkPhysicalDeviceUnifiedImageLayoutsFeaturesKHR`.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct PhysicalDeviceUnifiedImageLayoutsFeaturesKHR {
    pub(crate) s_type: StructureType,
    pub(crate) p_next: *mut c_void,
    pub(crate) unified_image_layouts: Bool32,
    pub(crate) unified_image_layouts_video: Bool32,
}

/// `VkPhysicalDeviceShaderRelaxedExtendedInstructionFeaturesKHR`.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct PhysicalDeviceShaderRelaxedExtendedInstructionFeaturesKHR {
    pub(crate) s_type: StructureType,
    pub(crate) p_next: *mut c_void,
    pub(crate) shader_relaxed_extended_instruction: Bool32,
}

/// `VkPhysicalDeviceShaderReplicatedCompositesFeaturesEXT`.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct PhysicalDeviceShaderReplicatedCompositesFeaturesEXT {
    pub(crate) s_type: StructureType,
    pub(crate) p_next: *mut c_void,
    pub(crate) shader_replicated_composites: Bool32,
}

/// `VkPhysicalDeviceZeroInitializeDeviceMemoryFeaturesEXT`.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct PhysicalDeviceZeroInitializeDeviceMemoryFeaturesEXT {
    pub(crate) s_type: StructureType,
    pub(crate) p_next: *mut c_void,
    pub(crate) zero_initialize_device_memory: Bool32,
}

/// `VkPhysicalDevicePrimitiveRestartIndexFeaturesEXT`.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct PhysicalDevicePrimitiveRestartIndexFeaturesEXT {
    pub(crate) s_type: StructureType,
    pub(crate) p_next: *mut c_void,
    pub(crate) primitive_restart_index: Bool32,
}

/// `vkCmdSetPrimitiveRestartIndexEXT`.
#[allow(non_camel_case_types, reason = "Vulkan's name")]
pub(crate) type PFN_vkCmdSetPrimitiveRestartIndexEXT =
    unsafe extern "system" fn(command_buffer: CommandBuffer, primitive_restart_index: u32);
