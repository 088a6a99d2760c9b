//! The extension's commands.

use ash::vk;
use ash::vk::TaggedStructure;
use gaurast::vk::{
    GaussianAntialiasingGAURAST, GaussianCameraDistortionGAURAST as Distortion, GaussianCameraGAURAST as Camera,
    GaussianCameraModelGAURAST as Model, GaussianDecodingTablesGAURAST as Tables,
    GaussianDistortionModelGAURAST as DistortionModel, GaussianOrderGAURAST,
    GaussianSphericalHarmonicsBufferGAURAST as Harmonics,
};

use crate::next::next;
use crate::recording::{Deferred, of};
use crate::table::*;
use gaurast_layer_interface::slice;

/// Makes the active mutant's change to a camera.
fn changed(mut camera: Camera<'_>) -> Camera<'_> {
    let [x, y, z] = camera.eye;
    CAMERA_EYE.replaces(&mut camera.eye, [-x, y, z]);
    CAMERA_EYE_BINARY32.replaces(&mut camera.eye, [x, y, z].map(|c| f64::from(c as f32)));
    for (mutant, model, mistaken) in [
        (&CAMERA_ORTHOGRAPHIC, Model::ORTHOGRAPHIC, Model::PINHOLE),
        (&CAMERA_FISHEYE, Model::FISHEYE, Model::PINHOLE),
        (&CAMERA_EQUIRECTANGULAR, Model::EQUIRECTANGULAR, Model::FISHEYE),
    ] {
        if camera.model == model {
            mutant.replaces(&mut camera.model, mistaken);
            break;
        }
    }
    let [xx, xy, xz, yx, yy, yz, zx, zy, zz] = camera.rotation;
    CAMERA_ROTATION.replaces(&mut camera.rotation, [xx, yx, zx, xy, yy, zy, xz, yz, zz]);
    CAMERA_FOCAL_LENGTH.changes(&mut camera.focal_length, |[x, _]| [x; 2]);
    CAMERA_PRINCIPAL_POINT.changes(&mut camera.principal_point, |[x, _]| [x; 2]);
    DEPTH_COEFFICIENTS.replaces(&mut camera.depth_coefficients, [1.0, -0.2]);
    let far = camera.far_plane;
    CAMERA_NEAR_PLANE.replaces(&mut camera.near_plane, 0.2_f32.min(far / 2.0));
    CAMERA_FAR_PLANE.replaces(&mut camera.far_plane, f32::INFINITY);
    camera
}

/// A copy of a camera's distortion with the active mutant's change; `None` if it has none, or none any more.
///
/// # Safety
/// The camera's chain is valid.
unsafe fn distortion(camera: &Camera<'_>) -> Option<Distortion<'static>> {
    let chained = camera.p_next.cast::<vk::BaseInStructure<'_>>();
    // SAFETY: the caller's promise. No other structure extends a camera.
    let given = unsafe {
        let is_distortion = chained.as_ref().is_some_and(|first| first.s_type == Distortion::STRUCTURE_TYPE);
        is_distortion.then(|| *chained.cast::<Distortion<'static>>())?
    };
    if DISTORTION_IGNORED.strikes(true) {
        return None;
    }
    let mut changed = Distortion { p_next: std::ptr::null(), ..given };
    DISTORTION_MODEL.replaces(&mut changed.model, DistortionModel::RATIONAL);
    if changed.model == DistortionModel::POLYNOMIAL_FIRST {
        DISTORTION_FIRST.replaces(&mut changed.model, DistortionModel::POLYNOMIAL);
    }
    let [k1, k2, ..] = changed.radial;
    DISTORTION_RADIAL.replaces(&mut changed.radial, [0.0; 6]);
    DISTORTION_RADIAL_HIGH.replaces(&mut changed.radial, [k1, k2, 0.0, 0.0, 0.0, 0.0]);
    DISTORTION_TANGENTIAL.replaces(&mut changed.tangential, [0.0; 2]);
    DISTORTION_TANGENTIAL_SWAPPED.changes(&mut changed.tangential, |[p1, p2]| [p2, p1]);
    DISTORTION_THIN_PRISM.replaces(&mut changed.thin_prism, [0.0; 4]);
    DISTORTION_THIN_PRISM_ORDER.changes(&mut changed.thin_prism, |[s1, s2, s3, s4]| [s1, s3, s2, s4]);
    Some(changed)
}

pub(super) unsafe extern "system" fn cmd_set_gaussian_cameras(
    commands: vk::CommandBuffer,
    count: u32,
    cameras: *const Camera<'_>,
) {
    let is_later = of(commands, |recording| recording.count("cameras")) > 0;
    if CAMERA_SET_ONCE.strikes(is_later) {
        return;
    }
    // SAFETY: see the crate.
    unsafe {
        let mut cameras: Vec<_> = slice(cameras, count).iter().copied().map(changed).collect();
        if VIEWS_ONE_CAMERA.strikes(count > 1) {
            cameras.truncate(1);
        }
        if VIEWS_LAST_CAMERA.strikes(count > 1) {
            cameras = cameras.pop().into_iter().collect();
        }
        if count > 2 && VIEWS_CAMERAS_PACKED.strikes(true) {
            cameras[2] = cameras[1];
        }
        let mut distortions: Vec<_> = cameras.iter().map(|camera| distortion(camera)).collect();
        if DISTORTION_OF_FIRST_VIEW.strikes(distortions.len() > 1) {
            let first = distortions[0];
            distortions.fill(first);
        }
        for (camera, distortion) in cameras.iter_mut().zip(&distortions) {
            camera.p_next = distortion.as_ref().map_or(std::ptr::null(), |chained| std::ptr::from_ref(chained).cast());
        }
        (next().cmd_set_gaussian_cameras)(commands, cameras.len() as u32, cameras.as_ptr());
    }
}

pub(super) unsafe extern "system" fn cmd_begin_gaussian_set(commands: vk::CommandBuffer) {
    let is_passed_on = of(commands, |recording| {
        recording.in_set = true;
        recording.draws_of_set = 0;
        let is_open = std::mem::replace(&mut recording.set_is_open, SETS_JOINED.is_active());
        !SET_APART.strikes(true) && !SETS_JOINED.strikes(is_open)
    });
    if is_passed_on {
        // SAFETY: see the crate.
        unsafe { (next().cmd_begin_gaussian_set)(commands) };
    }
}

pub(super) unsafe extern "system" fn cmd_end_gaussian_set(commands: vk::CommandBuffer) {
    let waiting = of(commands, |recording| {
        recording.in_set = false;
        std::mem::take(&mut recording.after_set)
    });
    // What is cleared late is cleared after the set.
    let (before, after) = if SET_CLEARED.is_active() { (Vec::new(), waiting) } else { (waiting, Vec::new()) };
    before.into_iter().for_each(|command: Deferred| command());
    if !SET_APART.is_active() && !SETS_JOINED.is_active() {
        // SAFETY: see the crate.
        unsafe { (next().cmd_end_gaussian_set)(commands) };
    }
    after.into_iter().for_each(|command| command());
}

/// Ends a set that a mutant has kept open up to the end of the pass.
pub(super) fn end_open_set(commands: vk::CommandBuffer) {
    if of(commands, |recording| std::mem::take(&mut recording.set_is_open)) {
        // SAFETY: see the crate.
        unsafe { (next().cmd_end_gaussian_set)(commands) };
    }
}

/// A command that sets a dynamic state: it is dropped after the first of its kind, if the mutant is active.
macro_rules! dynamic {
    ($($name:ident($type:ty);)*) => {
        $(pub(super) unsafe extern "system" fn $name(commands: vk::CommandBuffer, value: $type) {
            let is_later = of(commands, |recording| recording.count(stringify!($name))) > 0;
            if !DYNAMIC_SET_ONCE.strikes(is_later) {
                // SAFETY: see the crate.
                unsafe { (next().$name)(commands, value) };
            }
        })*
    };
}

dynamic! {
    cmd_set_gaussian_order(GaussianOrderGAURAST);
    cmd_set_gaussian_antialiasing(GaussianAntialiasingGAURAST);
    cmd_set_gaussian_low_pass_variance(f32);
    cmd_set_gaussian_alpha_floor(f32);
    cmd_set_gaussian_alpha_ceiling(f32);
    cmd_set_gaussian_transmittance_floor(f32);
    cmd_set_gaussian_spherical_harmonics_degree(u32);
    cmd_set_gaussian_exponential_error(f32);
    cmd_set_gaussian_contribution_budget(f32);
}

pub(super) unsafe extern "system" fn cmd_bind_gaussian_decoding_tables(
    commands: vk::CommandBuffer,
    tables: *const Tables<'_>,
) {
    let is_lost = of(commands, |recording| {
        let is_later = recording.count("decoding tables") > 0;
        let is_late = recording.in_set && recording.draws_of_set > 0;
        DECODING_REBOUND.strikes(is_later) || SET_DECODING_TABLES.strikes(is_late)
    });
    if is_lost {
        return;
    }
    // SAFETY: see the crate.
    unsafe {
        let mut tables = *tables;
        let position = &mut tables.position;
        let number = if position.format == vk::Format::R64_SFLOAT { 8 } else { 4 };
        if position.size > 0 {
            DECODING_ADDRESS.changes(&mut position.device_address, |address| address - 64);
            DECODING_SIZE.changes(&mut position.size, |size| size + 64);
            DECODING_SIZE_PARTIAL.changes(&mut position.size, |size| size.next_multiple_of(position.stride.into()));
            DECODING_STRIDE.replaces(&mut position.stride, 6 * number);
            DECODING_CHUNK_SIZE.replaces(&mut position.chunk_size, 256);
        }
        let (codes, labels) = (&mut tables.codes, &mut tables.labels);
        if codes.size > 0 {
            DECODING_CODES_SIZE.changes(&mut codes.size, |size| size + 64);
            DECODING_CODES_STRIDE.changes(&mut codes.stride, |stride| stride / codes.coefficient_stride.max(3) * 3);
            DECODING_COEFFICIENT_STRIDE.replaces(&mut codes.coefficient_stride, 3);
            DECODING_COMPONENT_STRIDE.replaces(&mut codes.component_stride, 1);
        }
        if labels.size > 0 {
            DECODING_LABELS_SIZE.changes(&mut labels.size, |size| size + 64);
            DECODING_LABELS_STRIDE.replaces(&mut labels.stride, 2);
        }
        (next().cmd_bind_gaussian_decoding_tables)(commands, &raw const tables);
    }
}

pub(super) unsafe extern "system" fn cmd_bind_gaussian_spherical_harmonics(
    commands: vk::CommandBuffer,
    buffer: *const Harmonics<'_>,
) {
    let is_lost = of(commands, |recording| {
        let is_later = recording.count("harmonics") > 0;
        let is_late = recording.in_set && recording.draws_of_set > 0;
        HARMONICS_REBOUND.strikes(is_later) || SET_HARMONICS.strikes(is_late)
    });
    if is_lost {
        return;
    }
    // SAFETY: see the crate.
    unsafe {
        let mut buffer = *buffer;
        HARMONICS_ADDRESS.changes(&mut buffer.device_address, |address| address - 64);
        HARMONICS_SIZE.changes(&mut buffer.size, |size| size + 64);
        HARMONICS_SIZE_HALF.changes(&mut buffer.size, |size| size / 2);
        HARMONICS_FORMAT.replaces(&mut buffer.format, vk::Format::R32G32B32_SFLOAT);
        HARMONICS_STRIDE.replaces(&mut buffer.stride, 48);
        HARMONICS_COEFFICIENT_STRIDE.replaces(&mut buffer.coefficient_stride, 12);
        (next().cmd_bind_gaussian_spherical_harmonics)(commands, &raw const buffer);
    }
}
