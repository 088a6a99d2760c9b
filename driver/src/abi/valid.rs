//! Pointers in a command's parameters as references, slices and strings; `pNext` chains; and the two-call idiom.
//!
//! Every unsafe function here has the same requirement: Vulkan's valid usage must hold for the pointer. That is, it is
//! null (which each function either refuses or allows) or valid for the type and the length, for as long as the command
//! lasts.

use crate::abi::error::Error;
use ash::vk;
use std::any::type_name;
use std::ffi::{CStr, c_char, c_void};
use std::mem::MaybeUninit;
use std::ops::{Deref, DerefMut};

fn null<T>() -> Error {
    Error::NullPointer { what: type_name::<T>() }
}

/// The value that a required pointer points at.
///
/// # Errors
/// [`Error::NullPointer`].
///
/// # Safety
/// See the module.
pub(crate) unsafe fn input<'a, T>(pointer: *const T) -> Result<&'a T, Error> {
    // SAFETY: the caller's promise.
    unsafe { pointer.as_ref() }.ok_or_else(null::<T>)
}

/// The value that an optional pointer points at.
///
/// # Safety
/// See the module.
pub(crate) unsafe fn optional<'a, T>(pointer: *const T) -> Option<&'a T> {
    // SAFETY: the caller's promise.
    unsafe { pointer.as_ref() }
}

/// An array parameter; a null pointer is allowed if `count` is zero.
///
/// # Errors
/// [`Error::NullPointer`].
///
/// # Safety
/// See the module.
pub(crate) unsafe fn slice<'a, T>(pointer: *const T, count: u32) -> Result<&'a [T], Error> {
    if count == 0 {
        return Ok(&[]);
    }
    if pointer.is_null() {
        return Err(null::<T>());
    }
    // SAFETY: the caller's promise, and not null.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count as usize) })
}

/// A string parameter; null is `None`.
///
/// # Safety
/// See the module; the string ends with a zero byte.
pub(crate) unsafe fn string<'a>(pointer: *const c_char) -> Option<&'a CStr> {
    if pointer.is_null() {
        return None;
    }
    // SAFETY: the caller's promise, and not null.
    Some(unsafe { CStr::from_ptr(pointer) })
}

/// An array of strings; null strings are left out.
///
/// # Errors
/// [`Error::NullPointer`].
///
/// # Safety
/// See the module; the strings end with a zero byte.
pub(crate) unsafe fn strings<'a>(pointer: *const *const c_char, count: u32) -> Result<Vec<&'a CStr>, Error> {
    // SAFETY: the caller's promise, for the array and each string.
    unsafe { Ok(slice(pointer, count)?.iter().filter_map(|&text| string(text)).collect()) }
}

/// Writes a result through a required pointer, without reading what was there.
///
/// # Errors
/// [`Error::NullPointer`].
///
/// # Safety
/// See the module.
pub(crate) unsafe fn output<T>(pointer: *mut T, value: T) -> Result<(), Error> {
    if pointer.is_null() {
        return Err(null::<T>());
    }
    // SAFETY: the caller's promise, and not null.
    unsafe { pointer.write(value) };
    Ok(())
}

/// A structure that the command fills in; its `sType` and `pNext` are the application's.
///
/// # Errors
/// [`Error::NullPointer`].
///
/// # Safety
/// See the module; the structure is initialised.
pub(crate) unsafe fn output_structure<'a, T>(pointer: *mut T) -> Result<&'a mut T, Error> {
    // SAFETY: the caller's promise; the application lends it to this command alone.
    unsafe { pointer.as_mut() }.ok_or_else(null::<T>)
}

/// An array of values that the command writes, without reading what was there.
///
/// # Errors
/// [`Error::NullPointer`].
///
/// # Safety
/// See the module.
pub(crate) unsafe fn output_slice<'a, T>(pointer: *mut T, count: usize) -> Result<&'a mut [MaybeUninit<T>], Error> {
    if count == 0 {
        return Ok(&mut []);
    }
    if pointer.is_null() {
        return Err(null::<T>());
    }
    // SAFETY: the caller's promise, and not null; the elements need not be initialised.
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer.cast::<MaybeUninit<T>>(), count) })
}

/// The two-call idiom over plain values: without an array, writes their number; with one, writes as many as fit, and
/// the number written.
///
/// # Errors
/// [`Error::NullPointer`] if `count` is null.
///
/// # Safety
/// See the module; `out` is null or has space for `*count` values.
pub(crate) unsafe fn enumerate<T: Copy>(count: *mut u32, out: *mut T, values: &[T]) -> Result<vk::Result, Error> {
    // SAFETY: the caller's promise; writing through the place does not read it.
    unsafe {
        enumerate_into(count, out, values.len(), |index, place: *mut T| {
            place.write(values[index]);
        })
    }
}

/// An array of structures that the application initialised, of which the command fills in as many as fit: the two-call
/// idiom.
pub(crate) struct Structures<'a, T> {
    count: &'a mut u32,
    out: *mut T,
}

impl<'a, T> Structures<'a, T> {
    /// The parameters of a command.
    ///
    /// # Errors
    /// [`Error::NullPointer`] if `count` is null.
    ///
    /// # Safety
    /// See the module; `out` is null or has `*count` initialised structures.
    pub(crate) unsafe fn new(count: *mut u32, out: *mut T) -> Result<Self, Error> {
        // SAFETY: the caller's promise.
        let count = unsafe { output_structure(count)? };
        Ok(Self { count, out })
    }

    /// Writes the number of structures if there is no array; otherwise calls `fill(index, structure)` for each that
    /// fits. `fill` must not change `sType` and `pNext`.
    ///
    /// # Errors
    /// None; the result is for the application.
    pub(crate) fn fill(self, available: usize, mut fill: impl FnMut(usize, &mut T)) -> Result<vk::Result, Error> {
        // SAFETY: the promise of `new`; each place is an initialised structure.
        unsafe {
            enumerate_into(self.count, self.out, available, |index, place: *mut T| {
                fill(index, &mut *place);
            })
        }
    }
}

/// The two-call idiom with a function that writes each element.
///
/// # Safety
/// As [`enumerate`]; `fill` may write through the pointer that it is given.
unsafe fn enumerate_into<T>(
    count: *mut u32,
    out: *mut T,
    available: usize,
    mut fill: impl FnMut(usize, *mut T),
) -> Result<vk::Result, Error> {
    // SAFETY: the caller's promise.
    let count = unsafe { output_structure(count)? };
    if out.is_null() {
        *count = available as u32;
        return Ok(vk::Result::SUCCESS);
    }
    let written = available.min(*count as usize);
    for index in 0..written {
        // SAFETY: `index` is less than the application's `*count`.
        fill(index, unsafe { out.add(index) });
    }
    *count = written as u32;
    Ok(if written < available { vk::Result::INCOMPLETE } else { vk::Result::SUCCESS })
}

/// The structures of an input chain, in order.
///
/// # Safety
/// `first` is null or begins a valid chain that outlives `'a`.
pub(crate) unsafe fn chain<'a>(first: *const c_void) -> impl Iterator<Item = &'a vk::BaseInStructure<'a>> {
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
/// As [`chain`].
pub(crate) unsafe fn find_in_chain<'a, T: vk::TaggedStructure>(first: *const c_void) -> Option<&'a T> {
    // SAFETY: the caller's promise.
    unsafe { chain(first) }.find_map(cast)
}

/// The structure as a `T`, if its `sType` says that it is one.
pub(crate) fn cast<'a, T: vk::TaggedStructure>(structure: &'a vk::BaseInStructure<'a>) -> Option<&'a T> {
    (structure.s_type == T::STRUCTURE_TYPE)
        // SAFETY: structures in a valid chain are what their sType says.
        .then(|| unsafe { &*std::ptr::from_ref(structure).cast::<T>() })
}

/// A structure of an output chain.
pub(crate) struct ChainedOutput<'a>(&'a mut vk::BaseOutStructure<'a>);

impl ChainedOutput<'_> {
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
pub(crate) unsafe fn for_each_output(first: *mut c_void, mut visit: impl FnMut(ChainedOutput<'_>)) {
    let mut next = first.cast::<vk::BaseOutStructure<'_>>();
    while !next.is_null() {
        // SAFETY: the caller's promise; every structure of a chain begins like `VkBaseOutStructure`.
        let structure = unsafe { &mut *next };
        next = structure.p_next;
        visit(ChainedOutput(structure));
    }
}

/// A structure that the command fills in, together with those that are chained to it.
pub(crate) struct OutputChain<'a, T>(&'a mut T);

impl<T: vk::TaggedStructure> OutputChain<'_, T> {
    /// The structure at a pointer.
    ///
    /// # Errors
    /// [`Error::NullPointer`].
    ///
    /// # Safety
    /// See the module; the structure is initialised, and its chain is valid.
    pub(crate) unsafe fn new(pointer: *mut T) -> Result<Self, Error> {
        // SAFETY: the caller's promise.
        unsafe { output_structure(pointer) }.map(Self)
    }

    /// Visits the structures that are chained to it, in order.
    pub(crate) fn for_each_chained(&mut self, visit: impl FnMut(ChainedOutput<'_>)) {
        let first = std::ptr::from_mut(self.0).cast::<vk::BaseOutStructure<'_>>();
        // SAFETY: the promise of `new`; a tagged structure begins like `VkBaseOutStructure`.
        unsafe { for_each_output((*first).p_next.cast(), visit) }
    }
}

impl<T> Deref for OutputChain<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.0
    }
}

impl<T> DerefMut for OutputChain<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ptr;

    #[test]
    fn enumeration_counts_then_fills_and_says_when_it_is_incomplete() {
        let values = [1u8, 2, 3];
        let fill = |count: &mut u32, out: *mut u8| {
            // SAFETY: `out` is null or has room for `*count` values.
            unsafe { enumerate(count, out, &values) }.unwrap()
        };
        let mut count = 0;
        assert_eq!(fill(&mut count, ptr::null_mut()), vk::Result::SUCCESS);
        assert_eq!(count, 3);

        let mut out = [0; 4];
        count = 2;
        assert_eq!(fill(&mut count, out.as_mut_ptr()), vk::Result::INCOMPLETE);
        assert_eq!((count, out), (2, [1, 2, 0, 0]));

        count = 4;
        assert_eq!(fill(&mut count, out.as_mut_ptr()), vk::Result::SUCCESS);
        assert_eq!((count, out), (3, [1, 2, 3, 0]));
    }

    #[test]
    fn null_pointers_are_refused_where_vulkan_requires_others() {
        // SAFETY: null pointers aren't followed.
        unsafe {
            assert!(input::<u32>(ptr::null()).is_err());
            assert!(output(ptr::null_mut(), 1u32).is_err());
            assert!(slice::<u32>(ptr::null(), 1).is_err());
            assert!(slice::<u32>(ptr::null(), 0).unwrap().is_empty());
            assert!(strings(ptr::null(), 0).unwrap().is_empty());
            assert!(enumerate(ptr::null_mut(), ptr::null_mut::<u32>(), &[]).is_err());
        }
    }

    #[test]
    fn structures_are_found_by_their_type() {
        let mut unknown = vk::PhysicalDeviceDriverProperties::default();
        let mut wanted = vk::PhysicalDeviceMaintenance3Properties::default();
        let mut head = vk::PhysicalDeviceProperties2::default().push_next(&mut wanted).push_next(&mut unknown);
        // SAFETY: ash built the chain of live structures.
        unsafe {
            for_each_output(head.p_next, |mut structure| {
                if let Some(out) = structure.cast::<vk::PhysicalDeviceMaintenance3Properties<'_>>() {
                    out.max_per_set_descriptors = 7;
                }
            });
            let first = (&raw mut head).cast_const().cast();
            assert_eq!(chain(first).count(), 3);
            let found = find_in_chain::<vk::PhysicalDeviceMaintenance3Properties<'_>>(first).unwrap();
            assert_eq!(found.max_per_set_descriptors, 7);
            assert!(find_in_chain::<vk::PhysicalDeviceIDProperties<'_>>(first).is_none());
            assert_eq!(chain(ptr::null()).count(), 0);
        }
    }
}
