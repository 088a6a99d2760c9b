//! The pointers in a command's parameters, as references, slices and strings, and the two-call idiom.
//!
//! Every function here is unsafe for one reason: Vulkan's valid usage must hold of the pointer, that is, it is null
//! (which is found and refused, or allowed, as each function says) or valid for the type and the length, for as long
//! as the command lasts.

use crate::error::Error;
use ash::vk;
use std::any::type_name;
use std::ffi::{CStr, c_char};

fn null<T>() -> Error {
    Error::NullPointer {
        what: type_name::<T>(),
    }
}

/// What a required pointer points at.
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

/// What an optional pointer points at.
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
pub(crate) unsafe fn strings<'a>(
    pointer: *const *const c_char,
    count: u32,
) -> Result<Vec<&'a CStr>, Error> {
    // SAFETY: the caller's promise, for the array and each string.
    unsafe {
        Ok(slice(pointer, count)?
            .iter()
            .filter_map(|&text| string(text))
            .collect())
    }
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

/// The two-call idiom over plain values: without an array, writes how many there are; with one, writes as many as
/// fit, and how many those were.
///
/// # Errors
/// [`Error::NullPointer`] if `count` is null.
///
/// # Safety
/// See the module; `out` is null or has room for `*count` values.
pub(crate) unsafe fn enumerate<T: Copy>(
    count: *mut u32,
    out: *mut T,
    values: &[T],
) -> Result<vk::Result, Error> {
    // SAFETY: the caller's promise; writing through the place does not read it.
    unsafe {
        enumerate_into(count, out, values.len(), |index, place: *mut T| {
            place.write(values[index]);
        })
    }
}

/// The two-call idiom over structures that the application initialised: `fill(index, structure)` is called for each
/// that fits and must leave `sType` and `pNext` alone.
///
/// # Errors
/// [`Error::NullPointer`] if `count` is null.
///
/// # Safety
/// See the module; `out` is null or has `*count` initialised structures.
pub(crate) unsafe fn enumerate_structures<T>(
    count: *mut u32,
    out: *mut T,
    available: usize,
    mut fill: impl FnMut(usize, &mut T),
) -> Result<vk::Result, Error> {
    // SAFETY: the caller's promise; each place is an initialised structure.
    unsafe {
        enumerate_into(count, out, available, |index, place: *mut T| {
            fill(index, &mut *place);
        })
    }
}

/// The idiom itself.
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
    Ok(if written < available {
        vk::Result::INCOMPLETE
    } else {
        vk::Result::SUCCESS
    })
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
}
