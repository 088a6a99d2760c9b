//! Macros that make the tables of features and properties types. A row is a field of the type, and belongs to the
//! structure in which Vulkan asks for it.

/// Declares `Features`, the features that are supported, and the functions between them and Vulkan's structures.
///
/// A row is `name => field: is_supported;`, with `, mandatory version` if a core version requires the feature. It is in
/// the first structure that holds the feature. The names of extensions follow each structure that each of them adds.
/// `repeated` structures hold only features that have rows elsewhere. The `core` structure is in no chain.
macro_rules! features {
    (
        core vk::$core:ident {$(
            $core_name:ident => $core_field:ident: $core_works:literal $(, mandatory $core_version:literal)?;
        )*}
        $(structure $structure:path $(: $($extension:literal)|+)? {$(
            $name:ident => $field:ident: $works:literal $(, mandatory $version:literal)?;
        )*})*
        $(repeated $repeated:path { $($member:ident),* })*
    ) => {
        /// Features, each once, whatever structures hold it.
        #[derive(Clone, Debug, PartialEq, Eq)]
        pub(crate) struct Features {
            $(#[doc = stringify!($core_name)] pub(crate) $core_field: bool,)*
            $($(#[doc = stringify!($name)] pub(crate) $field: bool,)*)*
        }

        /// The features that this driver supports.
        pub(crate) const SUPPORTED: Features =
            Features { $($core_field: $core_works,)* $($($field: $works,)*)* };

        /// The features that Vulkan makes mandatory, each with the core version that does.
        #[cfg(test)]
        pub(crate) const MANDATORY: &[(&str, &str)] = &[
            $($((stringify!($core_name), stringify!($core_version)),)?)*
            $($($((stringify!($name), stringify!($version)),)?)*)*
        ];

        impl Features {
            /// No feature.
            pub(crate) const NONE: Self = Self { $($core_field: false,)* $($($field: false,)*)* };

            /// The features by their names.
            pub(crate) fn list(&self) -> impl Iterator<Item = (&'static str, bool)> {
                [
                    $((stringify!($core_name), self.$core_field),)*
                    $($((stringify!($name), self.$field),)*)*
                ].into_iter()
            }

            /// Reports whether a feature is on, by its name.
            pub(crate) fn has(&self, feature: &str) -> bool {
                self.list().any(|(name, is_on)| is_on && name == feature)
            }

            /// The features of the core structure.
            pub(crate) fn core(&self) -> vk::$core {
                vk::$core { $($core_field: self.$core_field.into(),)* }
            }

            /// Adds the features that the core structure requests.
            pub(crate) fn add_core(&mut self, requested: &vk::$core) {
                $(self.$core_field |= requested.$core_field != vk::FALSE;)*
            }

            /// Writes the features to a structure of a chain, if it holds any that are known here.
            pub(crate) fn write(&self, mut structure: ChainedOutput<'_>) {
                $(if let Some(out) = structure.cast::<$structure>() { $(out.$field = self.$field.into();)* })*
                $(if let Some(out) = structure.cast::<$repeated>() { $(out.$member = self.$member.into();)* })*
            }

            /// Adds the features that a structure of a chain requests, if it holds any that are known here.
            pub(crate) fn add(&mut self, structure: &vk::BaseInStructure<'_>) {
                $(if let Some(requested) = valid::cast::<$structure>(structure) {
                    $(self.$field |= requested.$field != vk::FALSE;)*
                })*
                $(if let Some(requested) = valid::cast::<$repeated>(structure) {
                    $(self.$member |= requested.$member != vk::FALSE;)*
                })*
            }
        }

        /// The extensions without any of which the features of a structure can't be enabled; features of core need
        /// none.
        pub(crate) fn extensions_of(structure: vk::StructureType) -> &'static [&'static CStr] {
            const EXTENSIONS: &[(vk::StructureType, &[&CStr])] =
                &[$($((<$structure>::STRUCTURE_TYPE, &[$($extension),+]),)?)*];
            EXTENSIONS.iter().find(|(holder, _)| *holder == structure).map_or(&[], |(_, extensions)| *extensions)
        }
    };
}
pub(super) use features;

/// Declares `Properties`, and the functions that write them to Vulkan's structures.
///
/// A row is `name => field: type;`, in the first structure that holds the property. `repeated` structures hold only
/// properties that have rows elsewhere, some under another name: `member: field`. The structures `limits` and `sparse`
/// are members of `core`, which is in no chain.
macro_rules! properties {
    (
        core vk::$core:ident { $($core_name:ident => $core_field:ident: $core_ty:ty;)* }
        limits vk::$limits:ident { $($limits_name:ident => $limits_field:ident: $limits_ty:ty;)* }
        sparse vk::$sparse:ident { $($sparse_name:ident => $sparse_field:ident: $sparse_ty:ty;)* }
        $(structure $structure:path { $($name:ident => $field:ident: $ty:ty;)* })*
        $(repeated $repeated:path { $($member:ident $(: $other:ident)?),* })*
    ) => {
        /// Properties, each once, whatever structures hold it.
        #[derive(Clone, Debug)]
        pub(crate) struct Properties {
            $(#[doc = stringify!($core_name)] pub(crate) $core_field: $core_ty,)*
            $(#[doc = stringify!($limits_name)] pub(crate) $limits_field: $limits_ty,)*
            $(#[doc = stringify!($sparse_name)] pub(crate) $sparse_field: $sparse_ty,)*
            $($(#[doc = stringify!($name)] pub(crate) $field: $ty,)*)*
        }

        impl Properties {
            /// The properties of the core structure.
            pub(crate) fn core(&self) -> vk::$core {
                vk::$core {
                    $($core_field: self.$core_field,)*
                    limits: vk::$limits { $($limits_field: self.$limits_field.into(),)* },
                    sparse_properties: vk::$sparse { $($sparse_field: self.$sparse_field.into(),)* },
                }
            }

            /// Writes the properties to a structure of a chain, if it holds any that are known here.
            pub(crate) fn write(&self, mut structure: ChainedOutput<'_>) {
                $(if let Some(out) = structure.cast::<$structure>() { $(out.$field = self.$field.into();)* })*
                $(if let Some(out) = structure.cast::<$repeated>() {
                    $(out.$member = properties!(@field self, $member $($other)?).into();)*
                })*
            }
        }
    };
    (@field $properties:expr, $member:ident) => { $properties.$member };
    (@field $properties:expr, $member:ident $other:ident) => { $properties.$other };
}
pub(super) use properties;
