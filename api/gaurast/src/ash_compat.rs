//! All that depends on ash's version: how an enum, a flags type and a structure in a `pNext` chain
//! are declared, and how function pointers are loaded. A change of ash's shape is made here.

use core::ffi::{CStr, c_void};

use ash::vk::{
    ExtendsDeviceCreateInfo, ExtendsGraphicsPipelineCreateInfo, ExtendsPhysicalDeviceFeatures2,
    ExtendsPhysicalDeviceProperties2, StructureType, TaggedStructure,
};

use crate::vk::*;

/// Declares a Vulkan enum as ash does: a transparent `i32`, a constant per value, and a `Debug`
/// that prints the value's name, or its number where it has none.
macro_rules! vk_enum {
    (
        $(#[$meta:meta])*
        pub struct $name:ident { $($(#[$value_meta:meta])* $value:ident = $raw:expr,)* }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
        #[repr(transparent)]
        pub struct $name(i32);

        impl $name {
            $($(#[$value_meta])* pub const $value: Self = Self($raw);)*

            /// The enum with the raw value `x`, which need not have a name.
            #[inline]
            pub const fn from_raw(x: i32) -> Self {
                Self(x)
            }

            /// The raw value.
            #[inline]
            pub const fn as_raw(self) -> i32 {
                self.0
            }
        }

        impl core::fmt::Debug for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                match *self {
                    $(Self::$value => f.write_str(stringify!($value)),)*
                    Self(raw) => raw.fmt(f),
                }
            }
        }
    };
}
pub(crate) use vk_enum;

/// Writes ash's by-value setters, one for each named field. A field marked `bool` is a `Bool32`.
macro_rules! setters {
    ($($field:ident: bool,)*) => {$(
        #[doc = concat!("Sets [`", stringify!($field), "`](Self#structfield.", stringify!($field), ").")]
        #[inline]
        pub fn $field(mut self, $field: bool) -> Self {
            self.$field = $field.into();
            self
        }
    )*};
    ($($field:ident: $type:ty,)*) => {$(
        #[doc = concat!("Sets [`", stringify!($field), "`](Self#structfield.", stringify!($field), ").")]
        #[inline]
        pub fn $field(mut self, $field: $type) -> Self {
            self.$field = $field;
            self
        }
    )*};
}
pub(crate) use setters;

/// Makes a `repr(C)` structure that starts with `s_type` and `p_next` one that ash can chain: gives
/// it its structure type, the structures that it extends, and the thread safety of ash's own.
macro_rules! tagged_structure {
    ($name:ident = $s_type:expr $(, $extends:ident)*) => {
        // SAFETY: the structure is `repr(C)` and starts with `s_type` and `p_next`, as
        // `BaseOutStructure` does; `Default` and the setters keep `s_type` at this value.
        unsafe impl TaggedStructure for $name<'_> {
            const STRUCTURE_TYPE: StructureType = $s_type;
        }
        // SAFETY: the structure is plain data; `p_next` is only followed by Vulkan calls, which are
        // unsafe and state their own synchronisation.
        unsafe impl Send for $name<'_> {}
        // SAFETY: as above.
        unsafe impl Sync for $name<'_> {}
        $(
            // SAFETY: the extension lets the structure be chained there.
            unsafe impl $extends for $name<'_> {}
        )*
    };
}

tagged_structure!(
    PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST =
        STRUCTURE_TYPE_PHYSICAL_DEVICE_GAUSSIAN_PRIMITIVE_TOPOLOGY_FEATURES_GAURAST,
    ExtendsPhysicalDeviceFeatures2,
    ExtendsDeviceCreateInfo
);
tagged_structure!(
    PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST =
        STRUCTURE_TYPE_PHYSICAL_DEVICE_GAUSSIAN_PRIMITIVE_TOPOLOGY_PROPERTIES_GAURAST,
    ExtendsPhysicalDeviceProperties2
);
tagged_structure!(
    PipelineGaussianStateCreateInfoGAURAST =
        STRUCTURE_TYPE_PIPELINE_GAUSSIAN_STATE_CREATE_INFO_GAURAST,
    ExtendsGraphicsPipelineCreateInfo
);
tagged_structure!(
    PipelineGaussianApproximationStateCreateInfoGAURAST =
        STRUCTURE_TYPE_PIPELINE_GAUSSIAN_APPROXIMATION_STATE_CREATE_INFO_GAURAST,
    ExtendsGraphicsPipelineCreateInfo
);
tagged_structure!(GaussianCameraGAURAST = STRUCTURE_TYPE_GAUSSIAN_CAMERA_GAURAST);

/// A loader of `device`'s functions, for [`DeviceFn::load`].
///
/// [`DeviceFn::load`]: crate::gaussian_primitive_topology::DeviceFn::load
pub(crate) fn device_loader(
    instance: &ash::Instance,
    device: ash::vk::Device,
) -> impl FnMut(&CStr) -> *const c_void {
    move |name| {
        // SAFETY: `device` is the handle of a live `ash::Device` made from `instance`, and `name`
        // is a terminated string.
        let function = unsafe { instance.get_device_proc_addr(device, name.as_ptr()) };
        function.map_or(core::ptr::null(), |function| function as *const c_void)
    }
}

/// Loads `vkCmdSetGaussianCameraGAURAST`, or a function that ends the process, as ash does.
pub(crate) fn load_cmd_set_gaussian_camera(
    load: &mut dyn FnMut(&CStr) -> *const c_void,
) -> PFN_vkCmdSetGaussianCameraGAURAST {
    unsafe extern "system" fn missing(
        _command_buffer: ash::vk::CommandBuffer,
        _p_camera: *const GaussianCameraGAURAST<'_>,
    ) {
        panic!("Unable to load cmd_set_gaussian_camera_gaurast")
    }
    let function = load(c"vkCmdSetGaussianCameraGAURAST");
    if function.is_null() {
        missing
    } else {
        // SAFETY: the loader returns the function of that name, which has this type.
        unsafe {
            core::mem::transmute::<*const c_void, PFN_vkCmdSetGaussianCameraGAURAST>(function)
        }
    }
}
