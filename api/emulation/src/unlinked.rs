//! Chains without the extension's structures, which the next layer does not know.

use std::ffi::c_void;
use std::marker::PhantomData;

use ash::vk::{self, TaggedStructure};

/// A chain from which a structure is taken out that the next layer does not know. It is whole again when this is dropped.
pub(crate) struct Unlinked<T> {
    /// The member that names the structure, and the structure.
    place: Option<(*mut *mut vk::BaseOutStructure<'static>, *mut vk::BaseOutStructure<'static>)>,
    structure: PhantomData<T>,
}

impl<T: TaggedStructure> Unlinked<T> {
    /// # Safety
    /// `first` is the member that names the first structure of a valid chain, which nobody else uses while this lives.
    pub(crate) unsafe fn new(first: *mut *mut c_void) -> Self {
        let mut member = first.cast::<*mut vk::BaseOutStructure<'static>>();
        // SAFETY: the caller's promise.
        unsafe {
            while let Some(structure) = (*member).as_mut() {
                if structure.s_type == T::STRUCTURE_TYPE {
                    let place = Some((member, std::ptr::from_mut(structure)));
                    *member = structure.p_next;
                    return Self { place, structure: PhantomData };
                }
                member = (&raw mut structure.p_next).cast();
            }
        }
        Self { place: None, structure: PhantomData }
    }
}

impl<T> Drop for Unlinked<T> {
    fn drop(&mut self) {
        if let Some((member, structure)) = self.place {
            // SAFETY: the chain is as valid as before.
            unsafe { *member = structure };
        }
    }
}
