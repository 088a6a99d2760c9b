//! Spherical harmonics in a buffer that is given by its address.

use super::bench::{Options, Pipeline, SIZE, State, Stream, extension, pictures};
use ash::vk;
use gaurast::vk::{GaussianSphericalHarmonicsBufferGAURAST, PipelineGaussianStateCreateFlagsGAURAST as Flags};
use gaurast_testkit::devices::own;
use gaurast_tests::compare::{Limits, assert_contract};
use gaurast_tests::oracle::{OracleCamera, OracleInstance, OracleScene, OracleState, render_bounded};
use gaurast_tests::scenes;

type Picture = Vec<[f32; 4]>;
type Harmonics = GaussianSphericalHarmonicsBufferGAURAST<'static>;

/// A buffer with a device address.
struct Addressed {
    raw: vk::Buffer,
    memory: vk::DeviceMemory,
    /// The whole buffer, without format and strides.
    harmonics: Harmonics,
}

impl Addressed {
    fn of(bytes: &[u8]) -> Self {
        use vk::BufferUsageFlags as Usage;
        let (gpu, device) = (own(), own().device());
        let info = vk::BufferCreateInfo::default()
            .size(bytes.len() as u64)
            .usage(Usage::STORAGE_BUFFER | Usage::SHADER_DEVICE_ADDRESS);
        let host = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        // SAFETY: see the bench; the mapping is large enough for the bytes.
        unsafe {
            let raw = device.create_buffer(&info, None).expect("a buffer");
            let needed = device.get_buffer_memory_requirements(raw);
            let types = (gpu.instance()).get_physical_device_memory_properties(gpu.physical_device());
            let index = (0..types.memory_type_count)
                .find(|&index| {
                    let flags = types.memory_types[index as usize].property_flags;
                    needed.memory_type_bits >> index & 1 == 1 && flags.contains(host)
                })
                .expect("memory that the host sees");
            let mut flags = vk::MemoryAllocateFlagsInfo::default().flags(vk::MemoryAllocateFlags::DEVICE_ADDRESS);
            let info = vk::MemoryAllocateInfo::default()
                .allocation_size(needed.size)
                .memory_type_index(index)
                .push_next(&mut flags);
            let memory = device.allocate_memory(&info, None).expect("memory");
            device.bind_buffer_memory(raw, memory, 0).expect("it is bound");
            let no = vk::MemoryMapFlags::empty();
            let mapped = device.map_memory(memory, 0, vk::WHOLE_SIZE, no).expect("it is mapped");
            mapped.cast::<u8>().copy_from_nonoverlapping(bytes.as_ptr(), bytes.len());
            device.unmap_memory(memory);
            let info = vk::BufferDeviceAddressInfo::default().buffer(raw);
            let harmonics =
                Harmonics::default().device_address(device.get_buffer_device_address(&info)).size(bytes.len() as u64);
            Self { raw, memory, harmonics }
        }
    }
}

impl Drop for Addressed {
    fn drop(&mut self) {
        // SAFETY: see the bench.
        unsafe {
            own().device().destroy_buffer(self.raw, None);
            own().device().free_memory(self.memory, None);
        }
    }
}

fn camera() -> gaurast::vk::GaussianCameraGAURAST<'static> {
    scenes::camera(SIZE[0], SIZE[1]).to_vulkan()
}

fn drawn(
    streams: &[Stream],
    options: &Options<'_>,
    harmonics: Option<&Harmonics>,
    count: u32,
    instances: u32,
) -> Picture {
    let pipeline = Pipeline::new(streams, options);
    let mut all = pictures(1, 0, |commands| {
        pipeline.bind(commands, streams, None);
        // SAFETY: the command buffer is being recorded.
        unsafe {
            extension().cmd_set_gaussian_cameras(commands.raw, &[camera()]);
            if let Some(harmonics) = harmonics {
                extension().cmd_bind_gaussian_spherical_harmonics(commands.raw, harmonics);
            }
            (commands.device()).cmd_draw(commands.raw, count, instances, 0, 0);
        }
    });
    all.remove(0)
}

/// A state whose harmonics are in a buffer.
fn in_buffer(degree: u32) -> Options<'static> {
    let mut options = Options::new(State::default(), degree);
    options.state.flags |= Flags::SPHERICAL_HARMONICS_BUFFER;
    options.state.attribute_locations.first_spherical_harmonics = 4;
    options
}

/// Harmonics interleaved by Gaussian, by coefficient, and as half floats give the same picture as attributes.
#[gaurast_runner::test]
fn a_buffer_is_attributes() {
    let degree = 2;
    let scene = scenes::cloud(74, 1000, degree);
    let count = scene.positions.len();
    let mut streams = Stream::of(&scene);
    let by_attributes = drawn(&streams, &Options::new(State::default(), degree), None, count as u32, 1);
    streams.truncate(4);
    let interleaved = Addressed::of(bytemuck::cast_slice(&scene.sh));
    let packed = (interleaved.harmonics).format(vk::Format::R32G32B32_SFLOAT).stride(9 * 12).coefficient_stride(12);
    let options = in_buffer(degree);
    let picture = drawn(&streams, &options, Some(&packed), count as u32, 1);
    assert!(picture == by_attributes);
    let planes: Vec<[f32; 3]> =
        (0..9).flat_map(|k| (0..count).map(move |i| (k, i))).map(|(k, i)| scene.sh[9 * i + k]).collect();
    let planes = Addressed::of(bytemuck::cast_slice(&planes));
    let planar =
        (planes.harmonics).format(vk::Format::R32G32B32_SFLOAT).stride(12).coefficient_stride(12 * count as u64);
    let picture = drawn(&streams, &options, Some(&planar), count as u32, 1);
    assert!(picture == by_attributes);
    // Reads beyond the size give zero.
    let cut = drawn(&streams, &options, Some(&packed.size(9 * 12 * 10)), count as u32, 1);
    let mut dark = scene.clone();
    dark.sh[90..].fill([0.0; 3]);
    let oracle = OracleCamera::new(&camera(), SIZE).expect("a pinhole");
    let expected = render_bounded(&dark.as_oracle(), &oracle, &OracleState::default());
    assert_contract("cut", &cut, &expected, Limits::ENVELOPE_ONLY);
}

/// Degree 4 with a model matrix and an opacity factor works; as attributes it would need 33.
#[gaurast_runner::test]
fn degree_4_goes_with_a_matrix_and_a_factor() {
    let degree = 4;
    let scene = scenes::cloud(75, 500, degree);
    let count = scene.positions.len();
    let instances = [
        OracleInstance { matrix: [[0.9, 0.1, 0.0, 0.2], [-0.1, 0.9, 0.0, 0.0], [0.0, 0.0, 1.0, 0.5]], opacity: 0.9 },
        OracleInstance { matrix: [[0.7, 0.0, 0.0, -0.4], [0.0, 0.8, 0.2, 0.3], [0.0, -0.2, 0.8, 1.0]], opacity: 0.6 },
    ];
    let mut streams = Stream::of(&scene);
    streams.truncate(4);
    let floats: Vec<[f32; 13]> = instances
        .iter()
        .map(|one| {
            let matrix = one.matrix.as_flattened();
            std::array::from_fn(|i| *matrix.get(i).unwrap_or(&one.opacity))
        })
        .collect();
    streams.push(Stream::of_instances(28, &floats));
    let buffer = Addressed::of(bytemuck::cast_slice(&scene.sh));
    let harmonics = (buffer.harmonics).format(vk::Format::R32G32B32_SFLOAT).stride(25 * 12).coefficient_stride(12);
    let mut options = in_buffer(degree);
    options.state.attribute_locations.first_model_matrix = 28;
    options.state.attribute_locations.model_opacity = 31;
    let picture = drawn(&streams, &options, Some(&harmonics), count as u32, 2);
    let one = scene.as_oracle();
    let expanded: Vec<OracleInstance> = instances.iter().flat_map(|&one| std::iter::repeat_n(one, count)).collect();
    let whole = OracleScene {
        positions: &one.positions.repeat(2),
        scales: &one.scales.repeat(2),
        rotations: &one.rotations.repeat(2),
        opacities: &one.opacities.repeat(2),
        sh: &one.sh.repeat(2),
        instances: &expanded,
        ..one
    };
    let oracle = OracleCamera::new(&camera(), SIZE).expect("a pinhole");
    let expected = render_bounded(&whole, &oracle, &OracleState::default());
    assert!(expected.nominal.iter().filter(|p| p[3] > 0.1).count() > 1000);
    assert_contract("degree 4", &picture, &expected, Limits::ENVELOPE_ONLY);
}
