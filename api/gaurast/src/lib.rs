//! `VK_GAURAST_gaussian_primitive_topology` for [`ash`], in the form of the extensions that ash contains: a module with
//! the extension's [`NAME`] and [`Device`] functions, and the structures, enums and constants in [`vk`].
//!
//! ```no_run
//! # fn example(
//! #     instance: &ash::Instance,
//! #     physical_device: ash::vk::PhysicalDevice,
//! #     command_buffer: ash::vk::CommandBuffer,
//! #     create_info: ash::vk::DeviceCreateInfo<'_>,
//! #     view: [[f64; 4]; 4],
//! #     projection: [[f64; 4]; 4],
//! # ) -> Result<(), Box<dyn std::error::Error>> {
//! use gaurast::{gaussian_primitive_topology, vk};
//!
//! // Enable the extension and its base feature.
//! let names = [gaussian_primitive_topology::NAME.as_ptr()];
//! let mut features = vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST::default()
//!     .gaussian_primitive_topology(true);
//! let create_info = create_info.enabled_extension_names(&names).push_next(&mut features);
//! # // SAFETY: never run.
//! let device = unsafe { instance.create_device(physical_device, &create_info, None)? };
//!
//! // A pipeline whose vertex attributes are trained 3D Gaussians of SH degree 3.
//! let input_assembly = ash::vk::PipelineInputAssemblyStateCreateInfo::default()
//!     .topology(vk::PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST);
//! let mut gaussian_state = vk::PipelineGaussianStateCreateInfoGAURAST::default()
//!     .spherical_harmonics_degree(3)
//!     .attribute_locations(
//!         vk::GaussianAttributeLocationsGAURAST::default()
//!             .position(0)
//!             .scale(1)
//!             .rotation(2)
//!             .opacity(3)
//!             .first_spherical_harmonics(4), // 4..20
//!     );
//! let pipeline_info = ash::vk::GraphicsPipelineCreateInfo::default()
//!     .input_assembly_state(&input_assembly)
//!     .push_next(&mut gaussian_state);
//!
//! // The camera, before the draw.
//! let functions = gaussian_primitive_topology::Device::new(instance, &device);
//! let camera = vk::GaussianCameraGAURAST::from_view_projection(
//!     &view, &projection, [1280.0, 720.0],
//! )?;
//! # // SAFETY: never run.
//! unsafe { functions.cmd_set_gaussian_cameras(command_buffer, &[camera]) };
//! # Ok(())
//! # }
//! ```
//!
//! `VK_GAURAST_driver_options` is beside it: [`DriverOptionsGAURAST`](vk::DriverOptionsGAURAST) in the `pNext` chain of
//! `VkInstanceCreateInfo` sets the driver's threads, its instruction set, and a receiver of traces of work.
//!
//! [`NAME`]: gaussian_primitive_topology::NAME
//! [`Device`]: gaussian_primitive_topology::Device

mod ash_compat;
pub mod camera;
pub mod driver_options;
pub mod gaussian_primitive_topology;
mod options;
pub mod vk;

pub use options::WorkTrace;
