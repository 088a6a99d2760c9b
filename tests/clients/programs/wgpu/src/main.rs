//! wgpu: a compute shader's numbers are those of the processor, and a triangle covers the pixels that it must.

#[path = "../../wgpu_device.rs"]
mod wgpu_device;

use std::error::Error;
use wgpu::util::DeviceExt;
use wgpu_device::{bytes_of, target};

const COUNT: u32 = 100_000;
const COLLATZ: &str = include_str!("../../collatz.wgsl");

const SIZE: u32 = 256;
const TRIANGLE: &str = include_str!("../../triangle.wgsl");

/// The steps of the Collatz sequence from `n` to 1.
fn steps(n: u32) -> u32 {
    let (mut n, mut steps) = (u64::from(n), 0);
    while n > 1 {
        n = if n % 2 == 0 { n / 2 } else { 3 * n + 1 };
        steps += 1;
    }
    steps
}

/// The results of the compute shader.
fn computed(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Vec<u32>, Box<dyn Error>> {
    let numbers: Vec<u8> = (1..=COUNT).flat_map(u32::to_le_bytes).collect();
    let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: None,
        contents: &numbers,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
    });
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(COLLATZ.into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[wgpu::BindGroupEntry {
            binding: 0,
            resource: buffer.as_entire_binding(),
        }],
    });
    let read = target(device, numbers.len() as u64);
    let mut encoder = device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(COUNT.div_ceil(64), 1, 1);
    }
    encoder.copy_buffer_to_buffer(&buffer, 0, &read, 0, numbers.len() as u64);
    queue.submit([encoder.finish()]);
    let bytes = bytes_of(device, &read)?;
    let words = bytes.as_chunks().0.iter();
    Ok(words.map(|word| u32::from_le_bytes(*word)).collect())
}

/// The pixels of the triangle.
fn drawn(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Vec<[u8; 4]>, Box<dyn Error>> {
    let size = wgpu::Extent3d {
        width: SIZE,
        height: SIZE,
        depth_or_array_layers: 1,
    };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(TRIANGLE.into()),
    });
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vs"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fs"),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::TextureFormat::Rgba8Unorm.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    let view = texture.create_view(&Default::default());
    let mut encoder = device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
        pass.set_pipeline(&pipeline);
        pass.draw(0..3, 0..1);
    }
    queue.submit([encoder.finish()]);
    wgpu_device::pixels(device, queue, &texture, SIZE)
}

fn main() -> Result<(), Box<dyn Error>> {
    // The default limits are asked for.
    let (adapter, device, queue) = wgpu_device::open()?;

    let numbers = computed(&device, &queue)?;
    let differ = (1..=COUNT)
        .zip(&numbers)
        .filter(|(n, found)| steps(*n) != **found);
    let differ = differ.count();
    assert_eq!(
        (numbers.len(), differ),
        (COUNT as usize, 0),
        "numbers that differ"
    );

    // In pixels, the corners are (96, 160), (224, 160) and (96, 32): a pixel is covered if its centre is within.
    let pixels = drawn(&device, &queue)?;
    let differ = (0..).zip(&pixels).filter(|&(index, found)| {
        let (x, y) = (index % SIZE, index / SIZE);
        let along = (x + 160).saturating_sub(y + 96);
        let is_inside = x >= 96 && y < 160 && along < 128;
        // A centre on the slanted edge belongs to the triangle or not, by the rule of that edge.
        let is_on_edge = x >= 96 && y < 160 && along == 128;
        let expected = if is_inside {
            [x as u8, y as u8, 51, 255]
        } else {
            [0; 4]
        };
        *found != expected && !is_on_edge
    });
    assert_eq!(differ.count(), 0, "pixels of a triangle that differ");
    let name = adapter.get_info().name;
    println!(
        "{name}: {COUNT} numbers and {} pixels are equal",
        SIZE * SIZE
    );
    Ok(())
}
