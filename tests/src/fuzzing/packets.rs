//! Packets in any order and with any numbers, which no driver would send. The device refuses or executes them, and
//! writes only to the memory that they name.

use std::sync::Arc;

use simdevice::BufferRange;
use simdevice::format::{Aspect, ClearValue};
use simdevice::image::{ImageDesc, ImageKind};
use simdevice::packet::{
    Activations, Attachment, AttachmentClear, AttachmentResolve, AttributeStream, BlitImage, BufferCopyRegion,
    BufferImageRegion, ClearAttachments, ClearImage, CopyBuffer, CopyBufferImage, CopyImage, GaussianAppend,
    GaussianAttributes, GaussianBegin, ImageBlitRegion, ImageCopyRegion, IndexStream, LoadOp, ModelAttributes,
    Rendering, ResolveImage, StoreOp, SubresourceLayers, SubresourceRange,
};
use simdevice::state::gaussian::{
    Camera, CameraModel, Distortion, DistortionModel, GaussianGeometry, GaussianLinearization, GaussianOrder,
    GaussianPrecision, GaussianState,
};
use simdevice::state::{Rect, ResolveMode, Viewport};
use simdevice::stats::query::{QueryKind, QueryPool};
use simdevice::texture::Filter;
use simdevice::{Allocation, CommandProcessor, Config, Device, Format, Image, ImageView, Packet};

use super::bytes::Bytes;

/// Bytes of a buffer, and of the guards on both sides of the part that packets may use.
const BUFFER: u64 = 8192;
const GUARD: u64 = 1024;
const GUARDED: u8 = 0xA5;
/// Formats of images.
const FORMATS: [Format; 11] = [
    Format::R8G8B8A8Unorm,
    Format::R32G32B32A32Sfloat,
    Format::B8G8R8A8Srgb,
    Format::R16Uint,
    Format::D16Unorm,
    Format::D32Sfloat,
    Format::D24UnormS8Uint,
    Format::Bc1RgbUnormBlock,
    Format::Etc2R8G8B8A1SrgbBlock,
    Format::Astc5x4SrgbBlock,
    Format::Astc12x10UnormBlock,
];
/// The greatest number of packets of a run.
const PACKETS: usize = 60;

/// A device, and the resources that packets use.
pub struct Player {
    device: Arc<Device>,
}

/// The counts of executed and refused packets.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fared {
    /// They were executed.
    pub executed: u32,
    /// They were refused.
    pub refused: u32,
}

struct Resources {
    buffers: Vec<Arc<Allocation>>,
    images: Vec<Arc<Image>>,
    queries: Arc<QueryPool>,
}

impl Default for Player {
    fn default() -> Self {
        Self::new()
    }
}

impl Player {
    /// A device of one thread.
    ///
    /// # Panics
    /// If there is none.
    pub fn new() -> Self {
        let config = Config {
            threads: 1,
            // A small budget, so that some passes flush early.
            bin_budget_bytes: 1 << 16,
            ..Config::default()
        };
        Self { device: Arc::new(Device::new(&config).expect("a device")) }
    }

    /// Executes the packets that `data` encodes.
    ///
    /// # Panics
    /// If memory was written that no packet names.
    pub fn run(&self, data: &[u8]) -> Fared {
        let mut bytes = Bytes::new(data);
        let resources = Resources::new(&mut bytes);
        let mut processor = CommandProcessor::new(Arc::clone(&self.device));
        let mut fared = Fared::default();
        for _ in 0..PACKETS {
            if bytes.is_empty() {
                break;
            }
            for packet in packets(&mut bytes, &resources) {
                match processor.execute(&packet) {
                    Ok(()) => fared.executed += 1,
                    Err(error) => {
                        assert!(!error.to_string().is_empty());
                        fared.refused += 1;
                    }
                }
            }
        }
        drop(processor);
        resources.check_guards();
        fared
    }
}

impl Resources {
    fn new(bytes: &mut Bytes<'_>) -> Self {
        let buffer = |host_visible| {
            let memory = Allocation::new(BUFFER, host_visible).expect("memory");
            memory.fill(0, BUFFER, GUARDED).expect("it has room");
            memory
        };
        let buffers = vec![buffer(true), buffer(false)];
        // Data that resembles Gaussians: floats of ordinary size. There are few, so that most bytes are left for
        // packets. They repeat with a prime period, so that each element starts at another one.
        let pattern = [0; 61].map(|_| bytes.float());
        let count = (BUFFER - 2 * GUARD) as usize / 4;
        let floats: Vec<f32> = pattern.into_iter().cycle().take(count).collect();
        for memory in &buffers {
            memory.write(GUARD, &floats).expect("it has room");
        }
        let images = (0..4).filter_map(|_| image(bytes)).collect();
        let kind =
            bytes.one(&[QueryKind::Performance, QueryKind::Fragments, QueryKind::Timestamp, QueryKind::Simulated]);
        Self { buffers, images, queries: Arc::new(QueryPool::new(kind, 3)) }
    }

    fn check_guards(&self) {
        for memory in &self.buffers {
            for offset in [0, BUFFER - GUARD] {
                let mut guard = [0u8; GUARD as usize];
                memory.read(offset, &mut guard).expect("it lies inside");
                assert!(guard.iter().all(|&byte| byte == GUARDED), "a guard was written to");
            }
        }
    }

    /// A range between the guards. Packets may use any part of it.
    fn range(&self, bytes: &mut Bytes<'_>) -> BufferRange {
        let inside = BUFFER - 2 * GUARD;
        let offset = (u64::from(bytes.word()) % inside) & !3;
        BufferRange {
            memory: bytes.one(&self.buffers),
            offset: GUARD + offset,
            size: if bytes.rarely(3) { u64::from(bytes.word()) % (inside - offset) } else { inside - offset },
        }
    }

    fn image(&self, bytes: &mut Bytes<'_>) -> Option<Arc<Image>> {
        (!self.images.is_empty()).then(|| bytes.one(&self.images))
    }
}

fn image(bytes: &mut Bytes<'_>) -> Option<Arc<Image>> {
    let kind = bytes.one(&[ImageKind::D2, ImageKind::D2, ImageKind::D2, ImageKind::D3, ImageKind::D1]);
    let mut extent = [0; 3].map(|_| 1 + bytes.below(70) as u32);
    match kind {
        ImageKind::D1 => extent = [extent[0], 1, 1],
        ImageKind::D2 => extent[2] = 1,
        ImageKind::D3 => extent = extent.map(|side| side % 16 + 1),
    }
    let desc = ImageDesc {
        kind,
        format: bytes.one(&FORMATS),
        extent,
        mip_levels: bytes.one(&[1, 1, 2, 3]),
        array_layers: bytes.one(&[1, 1, 2, 5]),
        samples: bytes.one(&[1, 1, 1, 4]),
    };
    let memory = Allocation::new(desc.memory_size()?, bytes.rarely(2)).ok()?;
    Image::new(desc, memory, 0).ok().map(Arc::new)
}

fn view(bytes: &mut Bytes<'_>, image: Arc<Image>) -> ImageView {
    ImageView {
        format: image.desc.format,
        image,
        base_mip_level: bytes.one(&[0, 0, 0, 1]),
        level_count: 1,
        base_layer: bytes.one(&[0, 0, 0, 1]),
        layer_count: bytes.one(&[1, 1, 2]),
    }
}

fn clear_value(bytes: &mut Bytes<'_>) -> ClearValue {
    match bytes.below(4) {
        0 => ClearValue::Uint([0; 4].map(|_| bytes.word())),
        1 => ClearValue::Int([0; 4].map(|_| bytes.word().cast_signed())),
        2 => ClearValue::DepthStencil { depth: bytes.float(), stencil: bytes.word() },
        _ => ClearValue::Float([0; 4].map(|_| bytes.float())),
    }
}

fn rect(bytes: &mut Bytes<'_>) -> Rect {
    Rect {
        x: bytes.number(40).cast_signed(),
        y: bytes.number(40).cast_signed(),
        width: bytes.number(80),
        height: bytes.number(80),
    }
}

fn aspect(bytes: &mut Bytes<'_>) -> Aspect {
    bytes.one(&[Aspect::Color, Aspect::Color, Aspect::Depth, Aspect::Stencil])
}

fn layers(bytes: &mut Bytes<'_>) -> SubresourceLayers {
    SubresourceLayers {
        aspect: aspect(bytes),
        mip_level: bytes.number(2),
        base_layer: bytes.number(2),
        layer_count: bytes.number(3),
    }
}

fn offset(bytes: &mut Bytes<'_>) -> [i32; 3] {
    [0; 3].map(|_| bytes.number(20).cast_signed())
}

fn extent(bytes: &mut Bytes<'_>) -> [u32; 3] {
    [bytes.number(40), bytes.number(40), bytes.number(3)]
}

fn copy_region(bytes: &mut Bytes<'_>) -> ImageCopyRegion {
    ImageCopyRegion {
        source: layers(bytes),
        source_offset: offset(bytes),
        target: layers(bytes),
        target_offset: offset(bytes),
        extent: extent(bytes),
    }
}

/// One packet, or those of a whole draw.
fn packets(bytes: &mut Bytes<'_>, resources: &Resources) -> Vec<Packet> {
    match bytes.below(20) {
        0..5 => draw(bytes, resources),
        5 | 6 => rendering(bytes, resources).into_iter().collect(),
        7 => vec![Packet::EndRendering],
        8 => vec![Packet::Barrier],
        9 => vec![clear_attachments(bytes)],
        10 => vec![query(bytes, resources)],
        11 => vec![one_of_a_draw(bytes, resources)],
        12 | 13 => vec![buffer_packet(bytes, resources)],
        _ => image_packet(bytes, resources).into_iter().collect(),
    }
}

fn rendering(bytes: &mut Bytes<'_>, resources: &Resources) -> Option<Packet> {
    let attachment = |bytes: &mut Bytes<'_>| {
        let image = resources.image(bytes)?;
        let mut of = |image| Attachment {
            view: view(bytes, image),
            load: match bytes.below(3) {
                0 => LoadOp::Load,
                1 => LoadOp::DontCare,
                _ => LoadOp::Clear(clear_value(bytes)),
            },
            store: bytes.one(&[StoreOp::Store, StoreOp::Store, StoreOp::DontCare, StoreOp::None]),
            resolve: None,
            multisampled: None,
        };
        let mut attachment = of(image);
        if bytes.rarely(6) {
            let target = resources.image(bytes)?;
            let mode = bytes.one(&[ResolveMode::Average, ResolveMode::SampleZero, ResolveMode::Max]);
            attachment.resolve = Some(AttachmentResolve { view: view(bytes, target), mode });
        }
        Some(attachment)
    };
    let color: Vec<_> = (0..bytes.below(3)).map(|_| attachment(bytes)).collect();
    let depth = if bytes.rarely(2) { attachment(bytes) } else { None };
    let stencil = if bytes.rarely(4) { attachment(bytes) } else { None };
    let (mut area, mut layer_count) = (rect(bytes), bytes.number(3));
    if color.iter().flatten().next().is_none() && depth.is_none() && stencil.is_none() {
        // Nothing else limits the area. A larger one takes long and tests nothing more.
        (area.width, area.height) = (area.width % 3000, area.height % 3000);
        layer_count %= 5;
    }
    Some(Packet::BeginRendering(Box::new(Rendering { area, layer_count, view_mask: 0, color, depth, stencil })))
}

fn clear_attachments(bytes: &mut Bytes<'_>) -> Packet {
    let clear = match bytes.below(3) {
        0 => AttachmentClear::Depth(bytes.float()),
        1 => AttachmentClear::Stencil(bytes.word()),
        _ => AttachmentClear::Color { index: bytes.number(3) as usize, value: clear_value(bytes) },
    };
    Packet::ClearAttachments(ClearAttachments {
        clears: vec![clear],
        rects: vec![(rect(bytes), bytes.number(2), bytes.number(3))],
    })
}

fn query(bytes: &mut Bytes<'_>, resources: &Resources) -> Packet {
    let (pool, index) = (Arc::clone(&resources.queries), bytes.number(4));
    match bytes.below(4) {
        0 => Packet::BeginQuery { pool, index },
        1 => Packet::EndQuery { pool, index },
        2 => Packet::WriteTimestamp { pool, index },
        _ => Packet::ResetQueries { pool, first: index, count: bytes.number(4) },
    }
}

fn buffer_packet(bytes: &mut Bytes<'_>, resources: &Resources) -> Packet {
    let target = resources.range(bytes);
    match bytes.below(3) {
        0 => Packet::FillBuffer { target, word: bytes.word() },
        1 => Packet::UpdateBuffer {
            data: (0..target.size.min(64)).map(|_| bytes.byte()).collect(),
            target: BufferRange { size: target.size.min(64), ..target },
        },
        _ => {
            let source = resources.range(bytes);
            // Regions are within both images, as the driver guarantees.
            let most = source.size.min(target.size);
            let size = u64::from(bytes.word()) % (most + 1);
            let region =
                BufferCopyRegion { source_offset: source.size - size, target_offset: target.size - size, size };
            Packet::CopyBuffer(CopyBuffer { source, target, regions: vec![region] })
        }
    }
}

fn image_packet(bytes: &mut Bytes<'_>, resources: &Resources) -> Option<Packet> {
    let (source, target) = (resources.image(bytes)?, resources.image(bytes)?);
    Some(match bytes.below(6) {
        0 => Packet::ClearImage(ClearImage {
            image: target,
            value: clear_value(bytes),
            ranges: vec![SubresourceRange {
                aspect: aspect(bytes),
                base_mip_level: bytes.number(2),
                level_count: bytes.number(3),
                base_layer: bytes.number(2),
                layer_count: bytes.number(3),
            }],
        }),
        1 | 2 => {
            let copy = CopyBufferImage {
                buffer: resources.range(bytes),
                image: target,
                regions: vec![BufferImageRegion {
                    buffer_offset: bytes.number(200).into(),
                    buffer_row_length: bytes.number(50),
                    buffer_image_height: bytes.number(50),
                    subresource: layers(bytes),
                    image_offset: offset(bytes),
                    image_extent: extent(bytes),
                }],
            };
            if bytes.rarely(2) { Packet::CopyBufferToImage(copy) } else { Packet::CopyImageToBuffer(copy) }
        }
        3 => Packet::CopyImage(CopyImage { source, target, regions: vec![copy_region(bytes)] }),
        4 => Packet::BlitImage(BlitImage {
            source,
            target,
            filter: bytes.one(&[Filter::Nearest, Filter::Linear]),
            regions: vec![ImageBlitRegion {
                source: layers(bytes),
                source_corners: [offset(bytes), offset(bytes)],
                target: layers(bytes),
                target_corners: [offset(bytes), offset(bytes)],
            }],
        }),
        _ => Packet::ResolveImage(ResolveImage {
            source,
            target,
            mode: bytes.one(&[ResolveMode::Average, ResolveMode::Min, ResolveMode::SampleZero]),
            regions: vec![copy_region(bytes)],
        }),
    })
}

fn begin(bytes: &mut Bytes<'_>) -> Packet {
    let or = |bytes: &mut Bytes<'_>, usual: f32| {
        if bytes.rarely(6) { bytes.float() } else { usual }
    };
    let usual = GaussianState::default();
    let state = GaussianState {
        order: bytes.one(&[
            GaussianOrder::ViewDepth,
            GaussianOrder::RadialDistance,
            GaussianOrder::Primitive,
            GaussianOrder::PerPixel,
        ]),
        geometry: bytes.one(&[GaussianGeometry::Volume, GaussianGeometry::Volume, GaussianGeometry::Surfel]),
        precision: bytes.one(&[GaussianPrecision::Float32, GaussianPrecision::Float32, GaussianPrecision::Float16]),
        linearization: bytes.one(&[GaussianLinearization::Jacobian, GaussianLinearization::Unscented]),
        opacity_compensated: bytes.rarely(3),
        low_pass_variance: or(bytes, 0.3),
        alpha_floor: or(bytes, usual.alpha_floor),
        alpha_ceiling: or(bytes, 0.99),
        transmittance_floor: or(bytes, 1e-4),
        ..usual
    };
    let rotation = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0f32];
    Packet::GaussianBegin(Box::new(GaussianBegin {
        state: Arc::new(state),
        further_cameras: Vec::new(),
        camera: Camera {
            model: bytes.one(&[
                CameraModel::Pinhole,
                CameraModel::Pinhole,
                CameraModel::Orthographic,
                CameraModel::Fisheye,
                CameraModel::Equirectangular,
            ]),
            rotation: rotation.map(|entry| or(bytes, entry)),
            eye: [0.0, 0.0, -3.0f32].map(|axis| or(bytes, axis).into()),
            focal_length: [0; 2].map(|_| or(bytes, 30.0)),
            principal_point: [0; 2].map(|_| or(bytes, 20.0)),
            near_plane: or(bytes, 0.2),
            far_plane: or(bytes, f32::INFINITY),
            depth_coefficients: [0; 2].map(|_| or(bytes, 0.5)),
            distortion: bytes.one(&[false, false, true]).then(|| Distortion {
                model: bytes.one(&[
                    DistortionModel::Rational,
                    DistortionModel::Polynomial,
                    DistortionModel::PolynomialFirst,
                    DistortionModel::FieldOfView,
                    DistortionModel::Division,
                ]),
                radial: [0.1, -0.05, 0.01, 0.0, 0.0, 0.0f32].map(|k| or(bytes, k)),
                tangential: [0; 2].map(|_| or(bytes, 0.001)),
                thin_prism: [0; 4].map(|_| or(bytes, 0.0)),
            }),
        },
        viewport: Viewport {
            x: or(bytes, 0.0),
            y: or(bytes, 0.0),
            width: or(bytes, 60.0),
            height: or(bytes, 50.0),
            min_depth: or(bytes, 0.0),
            max_depth: or(bytes, 1.0),
        },
        scissor: rect(bytes),
    }))
}

fn append(bytes: &mut Bytes<'_>, resources: &Resources) -> Packet {
    let stream = |bytes: &mut Bytes<'_>, format| AttributeStream {
        buffer: resources.range(bytes),
        stride: bytes.number(64),
        offset: bytes.number(64),
        format,
        instance_divisor: bytes.rarely(6).then(|| bytes.number(3)),
    };
    let triple = Format::R32G32B32Sfloat;
    let model = ModelAttributes {
        matrix: bytes.rarely(4).then(|| Box::new([0; 3].map(|_| stream(bytes, Format::R32G32B32A32Sfloat)))),
        opacity: bytes.rarely(4).then(|| stream(bytes, Format::R32Sfloat)),
    };
    Packet::GaussianAppend(Box::new(GaussianAppend {
        attributes: GaussianAttributes {
            position: stream(bytes, triple),
            scale: stream(bytes, triple),
            rotation: stream(bytes, Format::R32G32B32A32Sfloat),
            opacity: stream(bytes, Format::R32Sfloat),
            model,
            activations: Activations {
                log_scale: bytes.rarely(8),
                logit_opacity: bytes.rarely(8),
                ..Activations::default()
            },
            tables: None,
            spherical_harmonics: vec![stream(bytes, triple)],
        },
        indices: bytes.rarely(4).then(|| IndexStream {
            buffer: resources.range(bytes),
            index_size: bytes.one(&[1, 2, 4]),
            vertex_offset: bytes.number(9).cast_signed(),
            restart: bytes.rarely(8).then(|| bytes.number(20)),
        }),
        first: bytes.number(20),
        // A larger count takes long and tests nothing more.
        count: bytes.number(600) % 5000,
        first_instance: bytes.number(4),
        instance_count: 1 + bytes.below(3) as u32,
    }))
}

fn draw(bytes: &mut Bytes<'_>, resources: &Resources) -> Vec<Packet> {
    let appends = bytes.below(3);
    let mut packets = vec![begin(bytes)];
    packets.extend((0..appends).map(|_| append(bytes, resources)));
    packets.push(Packet::GaussianEnd);
    packets
}

/// A packet of a draw in a place where it may be invalid.
fn one_of_a_draw(bytes: &mut Bytes<'_>, resources: &Resources) -> Packet {
    match bytes.below(3) {
        0 => begin(bytes),
        1 => append(bytes, resources),
        _ => Packet::GaussianEnd,
    }
}
