//! `pNext` chains.

use ash::vk;
use std::ffi::c_void;

/// The structures of an input chain, in order.
///
/// # Safety
/// `first` is null or begins a valid chain that outlives `'a`.
pub(crate) unsafe fn iter<'a>(
    first: *const c_void,
) -> impl Iterator<Item = &'a vk::BaseInStructure<'a>> {
    let mut next = first.cast::<vk::BaseInStructure<'a>>();
    std::iter::from_fn(move || {
        // SAFETY: the caller's promise; every structure of a chain begins like `VkBaseInStructure`.
        let structure = unsafe { next.as_ref() }?;
        next = structure.p_next;
        Some(structure)
    })
}

/// The first structure of type `T` in an input chain.
///
/// # Safety
/// As [`iter`].
pub(crate) unsafe fn find<'a, T: vk::TaggedStructure>(first: *const c_void) -> Option<&'a T> {
    // SAFETY: the caller's promise.
    unsafe { iter(first) }.find_map(cast)
}

/// The structure as a `T`, if its `sType` says that it is one.
pub(crate) fn cast<'a, T: vk::TaggedStructure>(
    structure: &'a vk::BaseInStructure<'a>,
) -> Option<&'a T> {
    (structure.s_type == T::STRUCTURE_TYPE)
        // SAFETY: structures in a valid chain are what their sType says.
        .then(|| unsafe { &*std::ptr::from_ref(structure).cast::<T>() })
}

/// A structure of an output chain.
pub(crate) struct Output<'a>(&'a mut vk::BaseOutStructure<'a>);

impl Output<'_> {
    /// The structure as a `T`, if its `sType` says that it is one.
    pub(crate) fn cast<T: vk::TaggedStructure>(&mut self) -> Option<&mut T> {
        (self.0.s_type == T::STRUCTURE_TYPE)
            // SAFETY: structures in a valid chain are what their sType says, and `self` borrows it exclusively.
            .then(|| unsafe { &mut *std::ptr::from_mut(self.0).cast::<T>() })
    }
}

/// Visits the structures of an output chain, in order.
///
/// # Safety
/// `first` is null or begins a valid chain that nothing else uses during the call.
pub(crate) unsafe fn for_each_output(first: *mut c_void, mut visit: impl FnMut(Output<'_>)) {
    let mut next = first.cast::<vk::BaseOutStructure<'_>>();
    while !next.is_null() {
        // SAFETY: the caller's promise; every structure of a chain begins like `VkBaseOutStructure`.
        let structure = unsafe { &mut *next };
        next = structure.p_next;
        visit(Output(structure));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn structures_are_found_by_their_type() {
        let mut unknown = vk::PhysicalDeviceDriverProperties::default();
        let mut wanted = vk::PhysicalDeviceMaintenance3Properties::default();
        let mut chain = vk::PhysicalDeviceProperties2::default()
            .push_next(&mut wanted)
            .push_next(&mut unknown);
        // SAFETY: ash built the chain of live structures.
        unsafe {
            for_each_output(chain.p_next, |mut structure| {
                if let Some(out) = structure.cast::<vk::PhysicalDeviceMaintenance3Properties<'_>>()
                {
                    out.max_per_set_descriptors = 7;
                }
            });
            let first = (&raw mut chain).cast_const().cast();
            assert_eq!(iter(first).count(), 3);
            let found = find::<vk::PhysicalDeviceMaintenance3Properties<'_>>(first).unwrap();
            assert_eq!(found.max_per_set_descriptors, 7);
            assert!(find::<vk::PhysicalDeviceIDProperties<'_>>(first).is_none());
            assert_eq!(iter(std::ptr::null()).count(), 0);
        }
    }
}
