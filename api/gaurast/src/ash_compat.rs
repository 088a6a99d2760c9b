//! All code that depends on ash's version: the declarations of enums, flags types and structures in a `pNext` chain,
//! and the loading of function pointers. Only this module adapts to another version.

use core::ffi::{CStr, c_void};

/// Declares a Vulkan enum as ash does: a transparent `i32`, a constant per value, and a `Debug` that prints the value's
/// name, or its number if it has none.
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

/// Declares Vulkan flags as ash does: transparent, a constant per bit, set operations, and a `Debug` that prints the
/// names of the set bits, and the number formed by the bits without a name.
macro_rules! vk_flags {
    (
        $(#[$meta:meta])*
        pub struct $name:ident { $($(#[$value_meta:meta])* $value:ident = $raw:expr,)* }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(transparent)]
        pub struct $name(ash::vk::Flags);

        #[expect(missing_docs, reason = "ash's macro leaves what it writes undocumented")]
        const _: () = {
            ash::vk_bitflags_wrapped!($name, ash::vk::Flags);
        };

        impl $name {
            $($(#[$value_meta])* pub const $value: Self = Self($raw);)*
        }

        impl core::fmt::Debug for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                let named: &[(Self, &str)] = &[$((Self::$value, stringify!($value)),)*];
                let mut unnamed = *self;
                let mut separator = "";
                for &(bit, name) in named {
                    if self.contains(bit) {
                        unnamed &= !bit;
                        write!(f, "{separator}{name}")?;
                        separator = " | ";
                    }
                }
                if unnamed.is_empty() {
                    Ok(())
                } else {
                    write!(f, "{separator}{:b}", unnamed.0)
                }
            }
        }
    };
}
pub(crate) use vk_flags;

/// Defines ash's by-value setters, one for each named field.
macro_rules! setters {
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

/// Defines the setters of fields that are a `Bool32`; each takes a `bool`.
macro_rules! bool_setters {
    ($($field:ident,)*) => {$(
        #[doc = concat!("Sets [`", stringify!($field), "`](Self#structfield.", stringify!($field), ").")]
        #[inline]
        pub fn $field(mut self, $field: bool) -> Self {
            self.$field = $field.into();
            self
        }
    )*};
}
pub(crate) use bool_setters;

/// Makes a `repr(C)` structure that starts with `s_type` and `p_next` chainable with ash: gives it its structure type,
/// the structures that it extends, and the thread safety of ash's own.
macro_rules! tagged_structure {
    ($name:ident = $s_type:expr $(, $extends:path)*) => {
        // SAFETY: the structure is `repr(C)` and starts with `s_type` and `p_next`, as
        // `BaseOutStructure` does; `Default` and the setters keep `s_type` at this value.
        unsafe impl ash::vk::TaggedStructure for $name<'_> {
            const STRUCTURE_TYPE: ash::vk::StructureType = $s_type;
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

pub(crate) use tagged_structure;

/// Defines the trait of the structures that may be chained to one of this crate's own, and the method that chains them,
/// as ash defines them for its own.
macro_rules! extended_structure {
    ($name:ident, $extends:ident) => {
        #[doc = concat!("Structures that [`", stringify!($name), "`] may have in its chain.")]
        ///
        /// # Safety
        /// The extension lets the structure be chained there.
        pub unsafe trait $extends: ash::vk::TaggedStructure {}

        impl<'a> $name<'a> {
            /// Prepends a structure, with those that are chained to it, to the chain.
            pub fn push_next<T: $extends>(mut self, next: &'a mut T) -> Self {
                let first = core::ptr::from_mut(next).cast::<ash::vk::BaseOutStructure<'_>>();
                let mut last = first;
                // SAFETY: each structure of a chain begins as `BaseOutStructure` does, and the chain is borrowed.
                unsafe {
                    while !(*last).p_next.is_null() {
                        last = (*last).p_next;
                    }
                    (*last).p_next = self.p_next.cast_mut().cast();
                }
                self.p_next = first.cast_const().cast();
                self
            }
        }
    };
}

pub(crate) use extended_structure;

/// A loader of `device`'s functions, for [`DeviceFn::load`].
///
/// [`DeviceFn::load`]: crate::gaussian_primitive_topology::DeviceFn::load
pub(crate) fn device_loader(instance: &ash::Instance, device: ash::vk::Device) -> impl FnMut(&CStr) -> *const c_void {
    move |name| {
        // SAFETY: `device` is the handle of a live `ash::Device` made from `instance`, and `name`
        // is a terminated string.
        let function = unsafe { instance.get_device_proc_addr(device, name.as_ptr()) };
        function.map_or(core::ptr::null(), |function| function as *const c_void)
    }
}
