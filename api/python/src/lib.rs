//! `_gaurast`: the native module of the Python package `gaurast`. It reads files and draws; the package's Python code,
//! in `python/gaurast`, checks and shapes arrays.
//!
//! The module holds no driver. It draws with the one beside it, `libvulkan_gaurast.so`, which is also the one that
//! the Vulkan loader loads.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod camera;
mod device;
mod driver;
mod errors;
mod scene;

use pyo3::prelude::*;

#[pymodule(gil_used = true)]
mod _gaurast {
    #[pymodule_export]
    use super::camera::{frame, look_at, read_cameras};
    #[pymodule_export]
    use super::device::{Device, device_names};
    #[pymodule_export]
    use super::scene::{NativeScene, from_arrays, garden, open};
}
