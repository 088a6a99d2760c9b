//! Frames of the renderer: a generated garden through each camera, in each mode, with depths and the device's counters.

use ash::vk::PerformanceCounterUnitKHR;
use gaurast_render::{CutOff, DeviceOptions, Frame, Precision, RenderError, Renderer, Settings};
use gaurast_scene::{Antialiasing, Camera, Geometry, SortOrder, garden};

/// Width and height of frames.
const SIZE: [u32; 2] = [160, 90];
/// Gaussians of the garden.
const GAUSSIANS: usize = 4000;

/// A frame: the camera and the settings.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    /// Its name.
    pub(crate) name: &'static str,
    camera: fn(&Camera) -> Camera,
    change: fn(&mut Settings),
}

/// All frames.
pub(crate) const ALL: &[View] = &[
    View { name: "pinhole", camera: Camera::clone, change: |_| () },
    View { name: "orthographic", camera: |camera| camera.orthographic(6.0), change: |_| () },
    View { name: "fisheye", camera: |camera| camera.fisheye(3.0), change: |_| () },
    View { name: "panorama", camera: Camera::panorama, change: |_| () },
    View { name: "order_distance", camera: Camera::clone, change: |s| s.order = SortOrder::Distance },
    View { name: "order_per_pixel", camera: Camera::clone, change: |s| s.order = SortOrder::PerPixel },
    View { name: "fisheye_per_pixel", camera: |camera| camera.fisheye(2.0), change: |s| s.order = SortOrder::PerPixel },
    View { name: "surfels", camera: Camera::clone, change: |s| s.geometry = Geometry::Surfel },
    View { name: "binary16", camera: Camera::clone, change: |s| s.precision = Precision::Fp16 },
    View { name: "compensated", camera: Camera::clone, change: |s| s.antialiasing = Antialiasing::Compensated },
    View { name: "ellipse", camera: Camera::clone, change: |s| s.cut_off = CutOff::Ellipse },
    View { name: "tile_square", camera: Camera::clone, change: |s| s.cut_off = CutOff::TileSquare },
    View { name: "tile_rectangle", camera: Camera::clone, change: |s| s.cut_off = CutOff::TileRectangle },
    View { name: "degree_0", camera: Camera::clone, change: |s| s.sh_degree = 0 },
    View { name: "degree_1", camera: Camera::clone, change: |s| s.sh_degree = 1 },
    View { name: "degree_2", camera: Camera::clone, change: |s| s.sh_degree = 2 },
    View { name: "approximate", camera: Camera::clone, change: |s| s.exponential_error = 1e-3 },
    View { name: "budget", camera: Camera::clone, change: |s| s.contribution_budget = 0.01 },
    View { name: "depths", camera: Camera::clone, change: |s| s.depth = true },
    View { name: "depths_of_fisheye", camera: |camera| camera.fisheye(3.0), change: |s| s.depth = true },
    View { name: "depths_of_panorama", camera: Camera::panorama, change: |s| s.depth = true },
];

/// The bytes of a frame: colours, depths, and the counters but for times.
pub(crate) fn bytes(options: &DeviceOptions, view: &View) -> Result<Vec<u8>, RenderError> {
    let mut renderer = Renderer::with_options(vulkan_gaurast::entry(), options)?;
    let mut scene = renderer.upload(&garden::scene(1, GAUSSIANS), None)?;
    let mut settings = Settings::default();
    (view.change)(&mut settings);
    renderer.set(&mut scene, settings)?;
    let camera = garden::camera(None, SIZE).expect("the garden's own camera is valid");
    let Frame { picture, counters, depth, .. } = renderer.render(&scene, &(view.camera)(&camera))?;
    let mut bytes = bytemuck::cast_slice(&picture.pixels).to_vec();
    bytes.extend_from_slice(bytemuck::cast_slice(&depth.unwrap_or_default()));
    let counted = counters.iter().filter(|counter| counter.unit != PerformanceCounterUnitKHR::NANOSECONDS);
    bytes.extend(counted.flat_map(|counter| counter.value.to_le_bytes()));
    Ok(bytes)
}
