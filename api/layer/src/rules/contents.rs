//! The contents of a draw's buffers, as the device finds them when it executes.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use ash::vk;
use gaurast::vk::{
    GAUSSIAN_LOCATION_UNUSED_GAURAST as UNUSED, GaussianCameraDataGAURAST, GaussianCameraGAURAST,
    GaussianCameraModelGAURAST as Model, GaussianCameraSourceGAURAST as CameraSource,
    GaussianGeometryGAURAST as Geometry, PipelineGaussianStateCreateFlagsGAURAST as Flags,
};

use crate::facts::{Camera, Facts};
use crate::formats::Format;
use crate::objects::BufferDescriptor;
use crate::recording::{Call, Draw};
use crate::report::Faults;
use crate::rules::pipeline::used_locations;
use crate::rules::{camera, draw};

/// The most Gaussians of a draw that are looked at: the first ones.
const MOST: u64 = 1 << 20;
/// The most bytes of a buffer that are looked at for a draw.
const MOST_BYTES: u64 = 512 << 20;
/// The share of a draw's Gaussians from which on something is no accident, as a divisor.
const SHARE: u64 = 20;

/// Reads bytes of a buffer by offset and number, where the layer is sure of them.
pub(crate) trait Reader {
    /// Bytes, or nothing if the layer does not know them all.
    fn read(&self, buffer: vk::Buffer, offset: u64, length: u64) -> Option<Vec<u8>>;

    /// The size of a buffer.
    fn size(&self, buffer: vk::Buffer) -> Option<u64>;

    /// The buffer of a descriptor; nothing if the layer does not know it, or a fault's text if it is not there.
    fn descriptor(&self, draw: &Draw) -> Option<Result<BufferDescriptor, String>>;
}

/// Checks a draw's contents.
pub(crate) fn check(draw: &Draw, reader: &dyn Reader, facts: &Facts, faults: &mut Faults) {
    let before = faults.0.len();
    let cameras = cameras(draw, reader, facts, faults);
    // What a wrong camera sees says nothing of the Gaussians.
    let Some(cameras) = cameras.filter(|_| faults.0.len() == before) else {
        return;
    };
    let Some(call) = direct(draw.call, reader, facts, faults) else {
        return;
    };
    let Some(gaussians) = Gaussians::of(draw, call, reader, faults) else {
        return;
    };
    count(draw, &gaussians, cameras.first(), faults);
}

/// The cameras of a draw, as far as they are known; of those in a uniform buffer, the rules are checked. Without the
/// buffer there are none.
fn cameras(draw: &Draw, reader: &dyn Reader, facts: &Facts, faults: &mut Faults) -> Option<Vec<Camera>> {
    if draw.state.camera_source == CameraSource::COMMAND {
        let cameras = draw.cameras.as_deref();
        return Some(cameras.cloned().unwrap_or_default());
    }
    let Some(found) = reader.descriptor(draw) else {
        return Some(Vec::new());
    };
    let id = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraBinding-90025";
    let (buffer, offset, range) = match found {
        Ok(found) => found,
        Err(text) => {
            faults.error(id, text);
            return None;
        }
    };
    let count = u64::from(draw.state.camera_count);
    let element = size_of::<GaussianCameraDataGAURAST>() as u64;
    let size = reader.size(buffer).unwrap_or(u64::MAX).saturating_sub(offset);
    let range = if range == vk::WHOLE_SIZE { size } else { range };
    if range < count * element {
        faults.error(
            id,
            format!(
                "the descriptor of the camera has a range of {range} bytes, but must have {element} times \
                 cameraCount ({count})"
            ),
        );
        return None;
    }
    let Some(bytes) = reader.read(buffer, offset, count * element) else {
        return Some(Vec::new());
    };
    let elements = bytes.chunks_exact(element as usize).enumerate();
    let cameras: Vec<_> = elements
        .map(|(index, bytes)| {
            let camera = camera_of(bytes);
            camera::check(&camera, &format!("cameras[{index}] of the uniform buffer"), facts, faults);
            draw::check_model(&camera, &draw.state, faults);
            camera
        })
        .collect();
    Some(cameras)
}

/// A camera from the 128 bytes of a `VkGaussianCameraDataGAURAST`.
fn camera_of(bytes: &[u8]) -> Camera {
    let word = |index: usize| {
        let bytes = bytes[4 * index..][..4].try_into();
        u32::from_le_bytes(bytes.unwrap_or_default())
    };
    let float = |index: usize| f32::from_bits(word(index));
    let double = |index: usize| f64::from_bits(u64::from(word(index)) | u64::from(word(index + 1)) << 32);
    let pair = |index: usize| [float(index), float(index + 1)];
    let camera = GaussianCameraGAURAST::default()
        .model(Model::from_raw(word(6).cast_signed()))
        .rotation(std::array::from_fn(|index| float(8 + index / 3 * 4 + index % 3)))
        .eye([double(0), double(2), double(4)])
        .focal_length(pair(20))
        .principal_point(pair(22))
        .depth_coefficients(pair(24))
        .near_plane(float(26))
        .far_plane(float(27));
    Camera::of(&camera, None)
}

/// The call with the parameters of an indirect one.
fn direct(call: Call, reader: &dyn Reader, facts: &Facts, faults: &mut Faults) -> Option<Call> {
    let Call::Indirect(buffer, offset, is_indexed) = call else {
        return Some(call);
    };
    let bytes = reader.read(buffer, offset, if is_indexed { 20 } else { 16 })?;
    let word =
        |index: usize| -> Option<u32> { Some(u32::from_le_bytes(bytes.get(4 * index..)?.get(..4)?.try_into().ok()?)) };
    let (count, instances, first) = (word(0)?, word(1)?, word(2)?);
    let gaussians = u64::from(count) * u64::from(instances);
    if facts.has_extension && gaussians > facts.max_gaussians_per_draw {
        faults.error(
            "VUID-vkCmdDraw-maxGaussiansPerDraw-90083",
            format!(
                "the indirect draw has {gaussians} Gaussians, but must not have more than {}",
                facts.max_gaussians_per_draw
            ),
        );
        return None;
    }
    Some(if is_indexed {
        Call::Indices([first, count, word(4)?, instances], word(3)?.cast_signed())
    } else {
        Call::Vertices([first, count, word(3)?, instances])
    })
}

/// Elements of a vertex buffer, from the first one that a draw reads.
struct Elements {
    bytes: Vec<u8>,
    first: u64,
    stride: u64,
}

/// An attribute, ready to be read.
struct Source {
    format: Format,
    offset: u64,
    /// The number of instances that take the same element, if it advances by instance; 0: all of them.
    divisor: Option<u64>,
    /// The place of its elements among those of all bindings.
    elements: usize,
}

/// The Gaussians of a draw, where the layer can read them.
struct Gaussians {
    /// By location.
    sources: Vec<Option<Source>>,
    elements: Vec<Elements>,
    vertices: Vec<u64>,
    first_instance: u64,
    instances: u64,
    total: u64,
}

impl Gaussians {
    fn of(draw: &Draw, call: Call, reader: &dyn Reader, faults: &mut Faults) -> Option<Self> {
        let (numbers, vertices) = match call {
            Call::Vertices(numbers) => {
                let [first, count, ..] = numbers.map(u64::from);
                (numbers, (first..first + count.min(MOST)).collect::<Vec<_>>())
            }
            Call::Indices(numbers, vertex_offset) => (numbers, indexed(draw, numbers, vertex_offset, reader, faults)?),
            Call::Indirect(..) => return None,
        };
        let [_, count, first_instance, instances] = numbers.map(u64::from);
        let (&low, &high) = (vertices.iter().min()?, vertices.iter().max()?);
        let looked_at = instances.min((MOST / count.max(1)).max(1));
        if looked_at == 0 {
            return None;
        }
        let mut gaussians = Self {
            sources: Vec::new(),
            elements: Vec::new(),
            vertices,
            first_instance,
            instances: looked_at,
            total: count * instances,
        };
        let mut places = BTreeMap::new();
        for (_, location, _) in used_locations(&draw.state) {
            let attribute = draw.pipeline.attributes.get(&location)?;
            let format = Format::of(attribute.format);
            let binding = draw.pipeline.bindings.get(&attribute.binding)?;
            let divisor = binding.by_instance.then_some(u64::from(binding.divisor));
            let range = match divisor {
                Some(divisor) => {
                    let steps = (looked_at - 1).checked_div(divisor);
                    first_instance..=first_instance + steps.unwrap_or(0)
                }
                None => low..=high,
            };
            if !format.is_readable() {
                return None;
            }
            let elements = match places.get(&attribute.binding) {
                Some(&place) => place,
                None => {
                    let elements = read_elements(draw, attribute.binding, range, reader)?;
                    gaussians.elements.push(elements);
                    let place = gaussians.elements.len() - 1;
                    places.insert(attribute.binding, place);
                    place
                }
            };
            let source = Source { format, offset: u64::from(attribute.offset), divisor, elements };
            gaussians.add(location, source)?;
        }
        Some(gaussians)
    }

    /// Adds an attribute; `None` beyond all locations that devices have.
    fn add(&mut self, location: u32, source: Source) -> Option<()> {
        let location = usize::try_from(location).ok().filter(|&location| location < 1024)?;
        if self.sources.len() <= location {
            self.sources.resize_with(location + 1, || None);
        }
        self.sources[location] = Some(source);
        Some(())
    }

    /// An attribute of a Gaussian; `None` beyond its buffer.
    fn attribute(&self, location: u32, vertex: u64, instance: u64) -> Option<[f32; 4]> {
        let source = self.sources.get(location as usize)?.as_ref()?;
        let elements = &self.elements[source.elements];
        let index = match source.divisor {
            Some(divisor) => self.first_instance + instance.checked_div(divisor).unwrap_or(0),
            None => vertex,
        };
        let offset = index.checked_sub(elements.first)? * elements.stride + source.offset;
        source.format.read(&elements.bytes, usize::try_from(offset).ok()?)
    }
}

/// Reads a range of the elements of a vertex buffer: those of vertices or of instances.
fn read_elements(draw: &Draw, number: u32, range: RangeInclusive<u64>, reader: &dyn Reader) -> Option<Elements> {
    let (first, last) = range.into_inner();
    let bound = draw.vertex_buffers.get(&number)?;
    let binding = draw.pipeline.bindings.get(&number)?;
    let stride = u64::from(bound.stride.unwrap_or(binding.stride));
    let size = reader.size(bound.buffer)?.saturating_sub(bound.offset);
    let size = bound.size.map_or(size, |given| given.min(size));
    let start = (first * stride).min(size);
    let attributes = draw.pipeline.attributes.values().filter(|attribute| attribute.binding == number);
    let ends = attributes.map(|a| u64::from(a.offset) + u64::from(Format::of(a.format).bytes));
    let end = (last * stride + ends.max().unwrap_or(stride)).min(size);
    if end - start > MOST_BYTES {
        return None;
    }
    Some(Elements { bytes: reader.read(bound.buffer, bound.offset + start, end - start)?, first, stride })
}

/// The vertices that indices name.
fn indexed(
    draw: &Draw,
    [first, count, ..]: [u32; 4],
    vertex_offset: i32,
    reader: &dyn Reader,
    faults: &mut Faults,
) -> Option<Vec<u64>> {
    let index = draw.index_buffer?;
    let bytes = draw::index_bytes(index.ty);
    let offset = index.offset + u64::from(first) * bytes;
    let has = reader.size(index.buffer)?.saturating_sub(offset) / bytes;
    let read = reader.read(index.buffer, offset, bytes * u64::from(count).min(MOST).min(has))?;
    let vertices: Vec<i64> = (read.chunks_exact(bytes as usize))
        .map(|chunk| {
            let value = chunk.iter().rev().fold(0, |value, &byte| value << 8 | i64::from(byte));
            value + i64::from(vertex_offset)
        })
        .collect();
    let holds = vertices_of(draw, reader)?;
    let beyond = vertices.iter().filter(|&&vertex| vertex < 0 || vertex as u64 >= holds);
    let (beyond, greatest) = (beyond.count(), vertices.iter().max().copied().unwrap_or(0));
    if beyond > 0 {
        faults.warning(
            "GAURAST-Draw-index-past-vertices",
            format!(
                "{beyond} of {} indices name no Gaussian: with the vertex offset the greatest is {greatest}, and the \
                     vertex buffers \
                 hold {holds}",
                vertices.len()
            ),
        );
        return None;
    }
    Some(vertices.into_iter().map(|vertex| vertex as u64).collect())
}

/// The number of vertices that all vertex buffers have.
fn vertices_of(draw: &Draw, reader: &dyn Reader) -> Option<u64> {
    let mut least = u64::MAX;
    for attribute in draw.pipeline.attributes.values() {
        let binding = draw.pipeline.bindings.get(&attribute.binding)?;
        if binding.by_instance {
            continue;
        }
        let bound = draw.vertex_buffers.get(&attribute.binding)?;
        let stride = u64::from(bound.stride.unwrap_or(binding.stride));
        let size = reader.size(bound.buffer)?.saturating_sub(bound.offset);
        let size = bound.size.map_or(size, |given| given.min(size));
        let element = u64::from(attribute.offset) + u64::from(Format::of(attribute.format).bytes);
        let holds = match size.checked_sub(element) {
            None => 0,
            Some(rest) => rest.checked_div(stride).map_or(u64::MAX, |count| count + 1),
        };
        least = least.min(holds);
    }
    Some(least)
}

/// Gaussians of a draw by what becomes of them.
#[derive(Debug, Default)]
struct Counts {
    all: u64,
    not_finite: u64,
    zero_quaternion: u64,
    negative_scale: u64,
    below_floor: u64,
    behind: u64,
    beyond: u64,
    outside: u64,
    drawn: u64,
    // What follows is counted beside.
    opacity_outside: u64,
    opacity_inside: u64,
    last_is_greatest: u64,
    is_last_axis: u64,
    small_scales: u64,
    no_model_opacity: u64,
}

fn count(draw: &Draw, gaussians: &Gaussians, camera: Option<&Camera>, faults: &mut Faults) {
    let mut counts = Counts::default();
    for instance in 0..gaussians.instances {
        for &vertex in &gaussians.vertices {
            if let Some(gaussian) = fetch(draw, gaussians, vertex, instance) {
                counts.add(draw, &gaussian, camera);
            }
        }
    }
    if counts.all > 0 {
        tell(draw, &counts, gaussians.total, faults);
    }
}

/// A Gaussian as it is stored.
struct Gaussian {
    position: [f32; 3],
    scale: [f32; 3],
    rotation: [f32; 4],
    opacity: f32,
    model: Option<[[f32; 4]; 3]>,
    model_opacity: Option<f32>,
    harmonics_are_finite: bool,
}

fn fetch(draw: &Draw, gaussians: &Gaussians, vertex: u64, instance: u64) -> Option<Gaussian> {
    let locations = &draw.state.attribute_locations;
    let get = |location: u32| gaussians.attribute(location, vertex, instance);
    let three = |location: u32| get(location).map(|[x, y, z, _]| [x, y, z]);
    let mut scale = three(locations.scale)?;
    if draw.state.geometry == Geometry::GAUSSIAN_2D {
        scale[2] = 0.0;
    }
    let model = if locations.first_model_matrix == UNUSED {
        None
    } else {
        let first = locations.first_model_matrix;
        Some([get(first)?, get(first + 1)?, get(first + 2)?])
    };
    let model_opacity = if locations.model_opacity == UNUSED { None } else { Some(get(locations.model_opacity)?[0]) };
    let in_buffer = draw.state.flags.contains(Flags::SPHERICAL_HARMONICS_BUFFER);
    let coefficients = (draw.state.spherical_harmonics_degree + 1).pow(2);
    let harmonics_are_finite = in_buffer
        || (0..coefficients).all(|k| {
            let triple = three(locations.first_spherical_harmonics + k);
            triple.is_none_or(|triple| triple.iter().all(|value| value.is_finite()))
        });
    Some(Gaussian {
        position: three(locations.position)?,
        scale,
        rotation: get(locations.rotation)?,
        opacity: get(locations.opacity)?[0],
        model,
        model_opacity,
        harmonics_are_finite,
    })
}

impl Counts {
    fn add(&mut self, draw: &Draw, gaussian: &Gaussian, camera: Option<&Camera>) {
        self.all += 1;
        let g = gaussian;
        let is_logit = draw.state.flags.contains(Flags::LOGIT_OPACITY);
        let is_log = draw.state.flags.contains(Flags::LOG_SCALE);
        let is_inside = (0.0..=1.0).contains(&g.opacity);
        self.opacity_outside += u64::from(!is_logit && !is_inside && g.opacity.is_finite());
        self.opacity_inside += u64::from(is_logit && is_inside);
        self.small_scales += u64::from(is_log && g.scale.iter().all(|s| (0.0..=1.0).contains(s)));
        let [w, x, y, z] = g.rotation.map(f32::abs);
        self.last_is_greatest += u64::from(z > w && z > x && z > y);
        self.is_last_axis += u64::from(w == 0.0 && x == 0.0 && y == 0.0 && z > 0.0);
        self.no_model_opacity += u64::from(g.model_opacity == Some(0.0));
        *self.place(draw, g, camera) += 1;
    }

    /// The count of what becomes of a Gaussian, by the first reason that holds.
    fn place(&mut self, draw: &Draw, gaussian: &Gaussian, camera: Option<&Camera>) -> &mut u64 {
        let g = gaussian;
        let (flags, state) = (draw.state.flags, &draw.state);
        let finite = |values: &[f32]| values.iter().all(|value| value.is_finite());
        let is_log = flags.contains(Flags::LOG_SCALE);
        let scale = if is_log { g.scale.map(f32::exp) } else { g.scale };
        let mut opacity = g.opacity;
        if flags.contains(Flags::LOGIT_OPACITY) {
            opacity = 1.0 / (1.0 + (-opacity).exp());
        }
        opacity *= g.model_opacity.unwrap_or(1.0);
        let model_is_finite = g.model.is_none_or(|model| finite(model.as_flattened()));
        let is_finite = finite(&g.position)
            && finite(&scale)
            && finite(&g.rotation)
            && opacity.is_finite()
            && g.harmonics_are_finite
            && model_is_finite;
        if !is_finite {
            return &mut self.not_finite;
        }
        if g.rotation == [0.0; 4] {
            return &mut self.zero_quaternion;
        }
        if scale.iter().any(|&s| s < 0.0) {
            return &mut self.negative_scale;
        }
        if opacity < state.alpha_floor {
            return &mut self.below_floor;
        }
        let Some(camera) = camera else {
            return &mut self.drawn;
        };
        match place(camera, g, scale, state.low_pass_variance, draw.viewport) {
            Place::Behind => &mut self.behind,
            Place::Beyond => &mut self.beyond,
            // A lens may show what lies outside of an ideal picture.
            Place::Outside if camera.distorts => &mut self.drawn,
            Place::Outside => &mut self.outside,
            Place::Inside => &mut self.drawn,
        }
    }
}

/// The place of a Gaussian, seen from the camera.
enum Place {
    Behind,
    Beyond,
    Outside,
    Inside,
}

fn place(camera: &Camera, gaussian: &Gaussian, scale: [f32; 3], low_pass: f32, viewport: Option<[f32; 4]>) -> Place {
    let mut position = gaussian.position.map(f64::from);
    let mut size = f64::from(scale.into_iter().fold(0.0, f32::max));
    if let Some(model) = gaussian.model {
        let rows = model.map(|row| row.map(f64::from));
        let [x, y, z] = position;
        position = rows.map(|[a, b, c, d]| a * x + b * y + c * z + d);
        let norm: f64 = rows.iter().flat_map(|row| &row[..3]).map(|value| value * value).sum();
        size *= norm.sqrt();
    }
    let [x, y, z] = std::array::from_fn(|axis| position[axis] - camera.eye[axis]);
    let row = |row: usize| {
        let r = |column: usize| f64::from(camera.rotation[3 * row + column]);
        r(0) * x + r(1) * y + r(2) * z
    };
    let [x, y, z] = [row(0), row(1), row(2)];
    let is_flat = camera.model == Model::PINHOLE || camera.model == Model::ORTHOGRAPHIC;
    let depth = if is_flat { z } else { (x * x + y * y + z * z).sqrt() };
    if depth <= f64::from(camera.near_plane) {
        return Place::Behind;
    }
    if depth >= f64::from(camera.far_plane) {
        return Place::Beyond;
    }
    let Some([_, _, width, height]) = viewport.filter(|_| is_flat) else {
        return Place::Inside;
    };
    let unit = if camera.model == Model::PINHOLE { z } else { 1.0 };
    // Six standard deviations, as wide as they may become at a grazing angle.
    let blur = 6.0 * f64::from(low_pass).sqrt();
    let is_near = |axis: usize, t: f64, side: f32| {
        let f = f64::from(camera.focal_length[axis]);
        let at = f * t / unit + f64::from(camera.principal_point[axis]);
        let slant = if camera.model == Model::PINHOLE { 1.0 + (t / z).abs() } else { 1.0 };
        let radius = 6.0 * f * size / unit * slant + blur;
        at >= -radius && at <= f64::from(side.abs()) + radius
    };
    if is_near(0, x, width) && is_near(1, y, height) { Place::Inside } else { Place::Outside }
}

/// Tells what is surely not meant.
fn tell(draw: &Draw, counts: &Counts, total: u64, faults: &mut Faults) {
    let c = counts;
    let all = c.all;
    let of = if all == total { format!("{all}") } else { format!("the first {all}") };
    let is_some_share = |count: u64| count > 0 && count * SHARE >= all;
    let nothing = if c.drawn == 0 { "; nothing is drawn" } else { "" };
    let before = faults.0.len();
    if c.not_finite > 0 {
        faults.warning(
            "GAURAST-Draw-not-finite",
            format!(
                "{} of {of} Gaussians have a position, scale, rotation, opacity, coefficient or matrix that is NaN \
                     or infinite, and are \
                 skipped{nothing}",
                c.not_finite
            ),
        );
    }
    if is_some_share(c.zero_quaternion) {
        faults.warning(
            "GAURAST-Draw-zero-quaternion",
            format!("{} of {of} Gaussians have a rotation of zeros, and are skipped{nothing}", c.zero_quaternion),
        );
    }
    if is_some_share(c.negative_scale) {
        faults.warning(
            "GAURAST-Draw-negative-scale",
            format!(
                "{} of {of} Gaussians have a negative scale, and are skipped{nothing}. Are they logarithms, as \
                     trained files hold \
                 them? Set VK_PIPELINE_GAUSSIAN_STATE_CREATE_LOG_SCALE_BIT_GAURAST",
                c.negative_scale
            ),
        );
    }
    if is_some_share(c.opacity_outside) {
        faults.warning(
            "GAURAST-Draw-opacity-outside",
            format!(
                "{} of {of} Gaussians have an opacity outside of 0 to 1. Are they logits, as trained files hold \
                     them? Set \
                 VK_PIPELINE_GAUSSIAN_STATE_CREATE_LOGIT_OPACITY_BIT_GAURAST",
                c.opacity_outside
            ),
        );
    }
    if all >= 16 && c.small_scales == all {
        faults.warning(
            "GAURAST-Draw-scale-twice",
            format!(
                "all of {of} Gaussians have scales of 0 to 1 with LOG_SCALE, so that their standard deviations are 1 \
                     to 2.7: are they \
                 standard deviations already?"
            ),
        );
    }
    if all >= 16 && c.opacity_inside == all {
        faults.warning(
            "GAURAST-Draw-opacity-twice",
            format!(
                "all of {of} Gaussians have opacities of 0 to 1 with LOGIT_OPACITY, so that they are drawn with 0.5 \
                     to 0.73: are they \
                 opacities already?"
            ),
        );
    }
    let is_other_order = c.is_last_axis == all || all >= 16 && c.last_is_greatest * 10 >= all * 9;
    if is_other_order {
        faults.warning(
            "GAURAST-Draw-quaternion-order",
            format!(
                "the last component of the rotation is the greatest in {} of {of} Gaussians: are they x, y, z, w? \
                     The order is w, x, y, z",
                c.last_is_greatest
            ),
        );
    }
    if c.no_model_opacity == all {
        faults.warning(
            "GAURAST-Draw-model-opacity",
            format!(
                "modelOpacity is 0 for all of {of} Gaussians, so that nothing is drawn: without a factor it is \
                 1, or unused"
            ),
        );
    }
    if faults.0.len() > before || c.drawn > 0 {
        return;
    }
    tell_nothing(draw, counts, &of, faults);
}

/// Tells why nothing is drawn.
fn tell_nothing(draw: &Draw, counts: &Counts, of: &str, faults: &mut Faults) {
    let c = counts;
    let reasons = [
        (
            c.below_floor,
            "GAURAST-Draw-opacity-floor",
            format!("have an opacity below alphaFloor ({})", draw.state.alpha_floor),
        ),
        (c.behind, "GAURAST-Draw-behind-camera", "are behind the camera's near plane".to_owned()),
        (c.beyond, "GAURAST-Draw-beyond-camera", "are beyond the camera's far plane".to_owned()),
        (c.outside, "GAURAST-Draw-outside-picture", "are outside of the picture".to_owned()),
    ];
    let text: Vec<String> = (reasons.iter())
        .filter(|(count, ..)| *count > 0)
        .map(|(count, _, reason)| format!("{count} {reason}"))
        .collect();
    if let Some((count, id, _)) = reasons.iter().max_by_key(|(count, ..)| *count)
        && *count > 0
    {
        let hint = match *id {
            "GAURAST-Draw-opacity-floor" => "",
            _ => {
                ". Camera axes are +x right, +y down, +z forward; the rows of rotation are these directions in the \
                     world"
            }
        };
        faults.warning(id, format!("none of {of} Gaussians is drawn: {}{hint}", text.join(", ")));
    }
}
