//! Scenes and packets that the tests share.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use simdevice::image::{ImageDesc, ImageKind};
use simdevice::packet::*;
use simdevice::state::gaussian::{Camera, CameraModel, GaussianState};
use simdevice::state::{BlendEquation, BlendEquations, BlendFactor, BlendOp, BlendState, Rect, Viewport};
use simdevice::{Allocation, BufferRange, Config, Format, Image, ImageView, Packet};
use std::sync::Arc;

/// The width of every test's framebuffer, in pixels. Neither side is a multiple of a tile's.
pub const WIDTH: u32 = 150;
/// The height of every test's framebuffer, in pixels.
pub const HEIGHT: u32 = 83;

/// The rectangle of all pixels.
pub const EVERYTHING: Rect = Rect { x: 0, y: 0, width: WIDTH, height: HEIGHT };

/// Blending of premultiplied colours with the "over" operator.
pub const OVER: BlendState = BlendState { equations: Some(BlendEquations::both(OVER_EQUATION)), write_mask: 0xF };
const OVER_EQUATION: BlendEquation =
    BlendEquation { source: BlendFactor::One, destination: BlendFactor::OneMinusSrcAlpha, op: BlendOp::Add };

/// An image of `layers` layers whose memory holds `byte` everywhere.
pub fn image(format: Format, layers: u32, byte: u8) -> ImageView {
    multisampled(format, 1, layers, byte)
}

/// An image of several samples per pixel whose memory holds `byte` everywhere.
pub fn multisampled(format: Format, samples: u32, layers: u32, byte: u8) -> ImageView {
    let desc = ImageDesc {
        kind: ImageKind::D2,
        format,
        extent: [WIDTH, HEIGHT, 1],
        mip_levels: 1,
        array_layers: layers,
        samples,
    };
    let memory = Allocation::new_zeroed(desc.memory_size().unwrap()).unwrap();
    memory.fill(0, memory.len(), byte).unwrap();
    ImageView {
        image: Arc::new(Image::new(desc, memory, 0).unwrap()),
        format,
        base_mip_level: 0,
        level_count: 1,
        base_layer: 0,
        layer_count: layers,
    }
}

/// All of an image's memory.
pub fn bytes(view: &ImageView) -> Vec<u8> {
    let memory = &view.image.memory;
    let mut out = vec![0u8; memory.len() as usize];
    memory.read(0, &mut out).unwrap();
    out
}

/// An attachment that is stored.
pub fn attachment(view: &ImageView, load: LoadOp) -> Attachment {
    Attachment { view: view.clone(), load, store: StoreOp::Store, resolve: None, multisampled: None }
}

/// A pass over one colour attachment.
pub fn rendering(color: Attachment) -> Rendering {
    Rendering { area: EVERYTHING, layer_count: 1, view_mask: 0, color: vec![Some(color)], depth: None, stencil: None }
}

/// The packets of one draw of `count` random Gaussians, in memory that the host may map.
pub fn gaussians(seed: u64, count: u32, blend: BlendState) -> Vec<Packet> {
    gaussians_in(true, seed, count, blend)
}

/// As [`gaussians`], in memory that the host may map or not.
pub fn gaussians_in(host_visible: bool, seed: u64, count: u32, blend: BlendState) -> Vec<Packet> {
    const FLOATS: usize = 14;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut floats = Vec::new();
    for _ in 0..count {
        floats.extend([rng.random_range(-2.0..2.0), rng.random_range(-1.2..1.2f32), rng.random_range(2.0..6.0)]);
        floats.extend([0; 3].map(|_| rng.random_range(-4.0..-1.0f32).exp()));
        floats.extend([0; 4].map(|_| rng.random_range(-1.0..1.0f32)));
        floats.push(rng.random_range(0.05..1.0));
        floats.extend([0; 3].map(|_| rng.random_range(-1.0..2.0f32)));
    }
    let size = 4 * floats.len() as u64;
    let memory = Allocation::new(size.max(4), host_visible).unwrap();
    memory.write(0, &floats).unwrap();
    let stream = |offset: u32, format| AttributeStream {
        buffer: BufferRange { memory: memory.clone(), offset: 0, size },
        stride: 4 * FLOATS as u32,
        offset: 4 * offset,
        format,
        instance_divisor: None,
    };
    let append = GaussianAppend {
        attributes: GaussianAttributes {
            position: stream(0, Format::R32G32B32Sfloat),
            scale: stream(3, Format::R32G32B32Sfloat),
            rotation: stream(6, Format::R32G32B32A32Sfloat),
            opacity: stream(10, Format::R32Sfloat),
            model: ModelAttributes::default(),
            activations: Default::default(),
            tables: None,
            spherical_harmonics: vec![stream(11, Format::R32G32B32Sfloat)],
        },
        indices: None,
        first: 0,
        count,
        first_instance: 0,
        instance_count: 1,
    };
    vec![Packet::GaussianBegin(Box::new(begin(blend))), Packet::GaussianAppend(Box::new(append)), Packet::GaussianEnd]
}

/// The state of the tests' Gaussian draws.
pub fn begin(blend: BlendState) -> GaussianBegin {
    GaussianBegin {
        state: Arc::new(GaussianState {
            blend: vec![blend],
            blend_constants: [0.5, 0.25, 0.75, 0.5],
            ..GaussianState::default()
        }),
        further_cameras: Vec::new(),
        camera: Camera {
            model: CameraModel::Pinhole,
            rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            eye: [0.0; 3],
            focal_length: [120.0; 2],
            principal_point: [WIDTH as f32 / 2.0, HEIGHT as f32 / 2.0],
            near_plane: 0.2,
            far_plane: f32::INFINITY,
            depth_coefficients: [0.0; 2],
            distortion: None,
        },
        viewport: Viewport {
            x: 0.0,
            y: 0.0,
            width: WIDTH as f32,
            height: HEIGHT as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        },
        scissor: EVERYTHING,
    }
}

/// A packet that clears rectangles of layer 0.
pub fn clear(clears: Vec<AttachmentClear>, rects: &[Rect]) -> Packet {
    Packet::ClearAttachments(ClearAttachments { clears, rects: rects.iter().map(|&rect| (rect, 0, 1)).collect() })
}

/// A configuration with one worker and defaults otherwise.
pub fn single() -> Config {
    Config { threads: 1, ..Config::default() }
}
