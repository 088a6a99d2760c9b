//! wgpu with its default limits: a chain of dispatches whose numbers are known, and a multisampled draw with depth whose
//! pixels are known.

use std::error::Error;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

/// Words of the buffer; a power of two.
const WORDS: u32 = 1 << 16;
/// Pixels of a side of the picture.
const SIZE: u32 = 256;

/// Each step adds the word at a distance, as in a scan by doubling.
const SCAN: &str = "
@group(0) @binding(0) var<storage, read> source: array<u32>;
@group(0) @binding(1) var<storage, read_write> result: array<u32>;
@group(0) @binding(2) var<uniform> distance: u32;
@compute @workgroup_size(128) fn main(@builtin(global_invocation_id) id: vec3u) {
    var sum = source[id.x];
    if id.x >= distance { sum += source[id.x - distance]; }
    result[id.x] = sum;
}";

/// Two squares: a green one, and a red one half behind it.
const SQUARES: &str = "
struct Out { @builtin(position) position: vec4f, @location(0) @interpolate(flat) colour: vec4f }
@vertex fn vs(@builtin(vertex_index) v: u32, @builtin(instance_index) i: u32) -> Out {
    let corner = vec2f(f32(v & 1u), f32(v >> 1u)) - select(0.25, 0.75, i == 0u);
    return Out(vec4f(corner, select(0.6, 0.3, i == 0u), 1.0), select(vec4f(1, 0, 0, 1), vec4f(0, 1, 0, 1), i == 0u));
}
@fragment fn fs(in: Out) -> @location(0) vec4f { return in.colour; }";

fn read(device: &wgpu::Device, buffer: &wgpu::Buffer) -> Result<Vec<u8>, Box<dyn Error>> {
    let slice = buffer.slice(..);
    slice.map_async(wgpu::MapMode::Read, |_| {});
    device.poll(wgpu::PollType::Wait {
        submission_index: None,
        timeout: None,
    })?;
    Ok(slice.get_mapped_range()?.to_vec())
}

fn readable(device: &wgpu::Device, size: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

fn module(device: &wgpu::Device, source: &str) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(source.into()),
    })
}

/// The words after a scan by doubling of 1, 2, 3 and so on.
fn scan(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Vec<u32>, Box<dyn Error>> {
    let words: Vec<u8> = (1..=WORDS).flat_map(u32::to_ne_bytes).collect();
    let buffers = [(); 2].map(|()| {
        device.create_buffer_init(&BufferInitDescriptor {
            label: None,
            contents: &words,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        })
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module(device, SCAN),
        entry_point: None,
        compilation_options: Default::default(),
        cache: None,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    for step in 0..WORDS.ilog2() {
        let distance = device.create_buffer_init(&BufferInitDescriptor {
            label: None,
            contents: &(1u32 << step).to_ne_bytes(),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let from = step as usize % 2;
        let bound = [&buffers[from], &buffers[1 - from], &distance];
        let entries: Vec<_> = (0..)
            .zip(bound)
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(WORDS / 128, 1, 1);
    }
    drop(pass);
    let result = readable(device, u64::from(4 * WORDS));
    let last = &buffers[WORDS.ilog2() as usize % 2];
    encoder.copy_buffer_to_buffer(last, 0, &result, 0, u64::from(4 * WORDS));
    queue.submit([encoder.finish()]);
    let bytes = read(device, &result)?;
    let words = bytes.as_chunks().0.iter().copied();
    Ok(words.map(u32::from_ne_bytes).collect())
}

/// The pixels of the two squares, four bytes each.
fn draw(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Vec<u8>, Box<dyn Error>> {
    let size = wgpu::Extent3d {
        width: SIZE,
        height: SIZE,
        depth_or_array_layers: 1,
    };
    let image = |format, samples, usage| {
        device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size,
            mip_level_count: 1,
            sample_count: samples,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        })
    };
    let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
    let colour = wgpu::TextureFormat::Rgba8Unorm;
    let depth = wgpu::TextureFormat::Depth32Float;
    let picture = image(colour, 1, attachment | wgpu::TextureUsages::COPY_SRC);
    let views = [
        picture.create_view(&Default::default()),
        image(colour, 4, attachment).create_view(&Default::default()),
        image(depth, 4, attachment).create_view(&Default::default()),
    ];
    let module = module(device, SQUARES);
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: depth,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState {
            count: 4,
            ..Default::default()
        },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            targets: &[Some(colour.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &views[1],
            depth_slice: None,
            resolve_target: Some(&views[0]),
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::BLUE),
                store: wgpu::StoreOp::Discard,
            },
        })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &views[2],
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(1.0),
                store: wgpu::StoreOp::Discard,
            }),
            stencil_ops: None,
        }),
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.draw(0..4, 0..2);
    drop(pass);
    let result = readable(device, u64::from(4 * SIZE * SIZE));
    encoder.copy_texture_to_buffer(
        picture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &result,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(4 * SIZE),
                rows_per_image: None,
            },
        },
        size,
    );
    queue.submit([encoder.finish()]);
    read(device, &result)
}

fn main() -> Result<(), Box<dyn Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::VULKAN,
        flags: wgpu::InstanceFlags::ALLOW_UNDERLYING_NONCOMPLIANT_ADAPTER,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;

    let words = scan(&device, &queue)?;
    let mut sum = 0u32;
    for (index, &word) in words.iter().enumerate() {
        sum = sum.wrapping_add(index as u32 + 1);
        if word != sum {
            return Err(format!("sum {index} is {word}, not {sum}").into());
        }
    }
    let pixels = draw(&device, &queue)?;
    for (index, pixel) in pixels.as_chunks::<4>().0.iter().enumerate() {
        let (x, y) = (index as u32 % SIZE, index as u32 / SIZE);
        // The green square's corners are at -0.75 and 0.25, the red one's at -0.25 and 0.75; y is up.
        let within = |from: u32, to: u32| (from..to).contains(&x) && (from..to).contains(&(SIZE - 1 - y));
        let want = if within(SIZE / 8, SIZE * 5 / 8) {
            [0, 255, 0, 255]
        } else if within(SIZE * 3 / 8, SIZE * 7 / 8) {
            [255, 0, 0, 255]
        } else {
            [0, 0, 255, 255]
        };
        if *pixel != want {
            return Err(format!("pixel ({x}, {y}) is {pixel:?}, not {want:?}").into());
        }
    }
    let name = adapter.get_info().name;
    println!("{name}: {WORDS} sums and {} pixels are equal", SIZE * SIZE);
    Ok(())
}
