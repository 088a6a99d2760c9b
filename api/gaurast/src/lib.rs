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
//! A compressed scene can be drawn as its file holds it. This is a compressed PLY of degree 0: four words for each Gaussian,
//! and the bounds of every 256.
//!
//! ```
//! use gaurast::vk::{self, GaussianDecodingGAURAST as Decoding};
//!
//! // Beside `PipelineGaussianStateCreateInfoGAURAST`, whose flags have `LOG_SCALE`. Positions, rotations, scales and
//! // colours are attributes of format `R32_UINT`, at offsets 0, 4, 8 and 12, and opacities of `R8_UNORM` at 12.
//! let decoding = vk::PipelineGaussianDecodingStateCreateInfoGAURAST::default()
//!     .position(Decoding::CHUNK)
//!     .rotation(vk::GaussianRotationDecodingGAURAST::SMALLEST_THREE_10)
//!     .scale(Decoding::CHUNK)
//!     .color(Decoding::CHUNK)
//!     .base_color(true);
//!
//! // The file's element `chunk` is in a buffer: minima and maxima of positions, then of scales, then of colours.
//! fn tables(address: ash::vk::DeviceAddress, chunks: u64) -> vk::GaussianDecodingTablesGAURAST<'static> {
//!     const CHUNK: u64 = 72;
//!     let from = |byte: u64| {
//!         vk::GaussianDecodingTableGAURAST::default()
//!             .device_address(address + byte)
//!             .size(chunks * CHUNK - byte)
//!             .format(ash::vk::Format::R32_SFLOAT)
//!             .stride(CHUNK as u32)
//!             .chunk_size(256)
//!     };
//!     vk::GaussianDecodingTablesGAURAST::default().position(from(0)).scale(from(24)).color(from(48))
//! }
//! let tables = tables(1 << 32, 100); // for `cmd_bind_gaussian_decoding_tables`, before the draw
//! assert_eq!(tables.color.size, 7152);
//! # assert_eq!(decoding.position, Decoding::CHUNK);
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
