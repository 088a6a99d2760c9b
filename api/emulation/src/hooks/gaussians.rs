//! The extension's own commands.

use std::marker::PhantomData;

use ash::vk;
use gaurast::vk::{
    GaussianAntialiasingGAURAST as Antialiasing, GaussianCameraDistortionGAURAST as Distortion,
    GaussianCameraGAURAST as Camera, GaussianDecodingTablesGAURAST as TablesInfo, GaussianOrderGAURAST as Order,
    GaussianSphericalHarmonicsBufferGAURAST as HarmonicsInfo,
};
use gaurast_layer_interface::{find, slice};

use crate::cameras::{SeenBy, camera_data};
use crate::decoding::Tables;
use crate::hooks::site::record;
use crate::lens;
use crate::recording::HarmonicsBuffer;

/// The lens of a camera, if it distorts.
///
/// # Safety
/// The camera's chain is valid.
unsafe fn lens_of(camera: &Camera<'_>) -> Option<Distortion<'static>> {
    // SAFETY: the caller's promise.
    let lens = unsafe { find::<Distortion<'_>>(camera.p_next) };
    let lens = lens.filter(|lens| lens::distorts(lens))?;
    Some(Distortion { p_next: std::ptr::null(), _marker: PhantomData, ..*lens })
}

pub(super) unsafe extern "system" fn cmd_set_gaussian_cameras(
    commands: vk::CommandBuffer,
    count: u32,
    cameras: *const Camera<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        let cameras = slice(cameras, count);
        record(
            commands,
            |_, recording| {
                let seen = |camera: &Camera<'_>| SeenBy { camera: camera_data(camera), lens: lens_of(camera) };
                recording.cameras = cameras.iter().map(seen).collect();
            },
            |_| {},
        );
    }
}

pub(super) unsafe extern "system" fn cmd_begin_gaussian_set(commands: vk::CommandBuffer) {
    // SAFETY: see the crate.
    unsafe { record(commands, |_, recording| recording.is_in_set = true, |_| {}) };
}

pub(super) unsafe extern "system" fn cmd_end_gaussian_set(commands: vk::CommandBuffer) {
    // SAFETY: see the crate.
    unsafe {
        record(
            commands,
            |site, recording| {
                recording.is_in_set = false;
                recording.end_set(site.emulation);
            },
            |_| {},
        );
    }
}

pub(super) unsafe extern "system" fn cmd_bind_gaussian_spherical_harmonics(
    commands: vk::CommandBuffer,
    buffer: *const HarmonicsInfo<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        let info = &*buffer;
        let bound = HarmonicsBuffer {
            address: info.device_address,
            size: info.size,
            format: info.format,
            stride: info.stride,
            coefficient_stride: info.coefficient_stride,
        };
        record(commands, |_, recording| recording.harmonics = Some(bound), |_| {});
    }
}

pub(super) unsafe extern "system" fn cmd_bind_gaussian_decoding_tables(
    commands: vk::CommandBuffer,
    tables: *const TablesInfo<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        let bound = Tables::new(&*tables);
        record(commands, |_, recording| recording.tables = Some(bound), |_| {});
    }
}

macro_rules! values {
    ($($name:ident, $member:ident, $type:ty, $value:expr;)*) => {$(
        pub(super) unsafe extern "system" fn $name(commands: vk::CommandBuffer, value: $type) {
            let kept = $value;
            // SAFETY: see the crate.
            unsafe { record(commands, |_, recording| recording.values.$member = Some(kept(value)), |_| {}) };
        }
    )*};
}

values! {
    cmd_set_gaussian_order, order, Order, |order: Order| order.as_raw().cast_unsigned();
    cmd_set_gaussian_antialiasing, is_compensated, Antialiasing, |mode: Antialiasing| mode.as_raw() == 1;
    cmd_set_gaussian_low_pass_variance, low_pass, f32, |value: f32| value;
    cmd_set_gaussian_alpha_floor, alpha_floor, f32, |value: f32| value;
    cmd_set_gaussian_alpha_ceiling, alpha_ceiling, f32, |value: f32| value;
    cmd_set_gaussian_transmittance_floor, transmittance_floor, f32, |value: f32| value;
    cmd_set_gaussian_spherical_harmonics_degree, degree, u32, |value: u32| value;
    cmd_set_gaussian_exponential_error, exponential_error, f32, |value: f32| value;
    cmd_set_gaussian_contribution_budget, contribution_budget, f32, |value: f32| value;
}
