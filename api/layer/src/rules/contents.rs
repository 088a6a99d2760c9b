//! The contents of a draw's buffers, as the device finds them when it executes.

use std::hash::{DefaultHasher, Hash, Hasher};

use ash::vk;
use gaurast::vk::{
    GaussianCameraDataGAURAST, GaussianCameraGAURAST, GaussianCameraModelGAURAST as Model,
    GaussianCameraSourceGAURAST as CameraSource, PipelineGaussianStateCreateFlagsGAURAST as Flags,
};

use crate::facts::{Camera, Facts};
use crate::recording::{Call, Draw};
use crate::report::Faults;
use crate::rules::counts::count;
use crate::rules::gaussians::Gaussians;
use crate::rules::ranges::Ranges;
use crate::rules::reader::Reader;
use crate::rules::{camera, depth, draw, indirect};

/// The most draws of an indirect command whose ranges are looked at.
const MOST_DRAWS: u32 = 4096;
/// The most draws of an indirect command whose Gaussians are looked at.
const MOST_CALLS: usize = 16;

/// A look at draws.
pub(crate) struct Look<'a> {
    pub(crate) reader: &'a dyn Reader,
    pub(crate) facts: &'a Facts,
    /// Attributes are looked at, too.
    pub(crate) with_attributes: bool,
}

impl Look<'_> {
    /// Checks a draw's contents.
    pub(crate) fn check(&self, draw: &Draw, faults: &mut Faults) {
        let before = faults.0.len();
        self.check_harmonics(draw, faults);
        self.check_tables(draw, faults);
        let cameras = self.cameras(draw, faults);
        // What a wrong camera sees says nothing of the Gaussians.
        let cameras = cameras.filter(|_| faults.0.len() == before);
        let calls = self.calls(draw, faults);
        if faults.0.len() > before || !self.with_attributes {
            return;
        }
        let Some(cameras) = cameras else { return };
        for call in calls.into_iter().take(MOST_CALLS) {
            let Some(gaussians) = Gaussians::of(draw, call, self.reader, faults) else {
                continue;
            };
            count(draw, &gaussians, cameras.first(), faults);
            if faults.0.len() > before {
                return;
            }
        }
    }

    fn check_harmonics(&self, draw: &Draw, faults: &mut Faults) {
        if !draw.state.flags.contains(Flags::SPHERICAL_HARMONICS_BUFFER) {
            return;
        }
        let buffer = draw.inputs.harmonics.and_then(|bound| bound.buffer);
        let lives = buffer.is_none_or(|(buffer, serial)| self.reader.lives(buffer, serial));
        faults.require(lives, "VUID-VkGaussianSphericalHarmonicsBufferGAURAST-deviceAddress-90016", || {
            "the buffer of the harmonics was destroyed before the submission".to_owned()
        });
    }

    fn check_tables(&self, draw: &Draw, faults: &mut Faults) {
        if draw.pipeline.decoding.is_none() {
            return;
        }
        let mut buffers = draw.inputs.decoding_tables.iter().flat_map(|bound| &bound.buffers);
        let live = buffers.all(|&(buffer, serial)| self.reader.lives(buffer, serial));
        faults.require(live, "VUID-VkGaussianDecodingTableGAURAST-deviceAddress-90099", || {
            "a buffer of tables was destroyed before the submission".to_owned()
        });
    }

    /// The cameras of a draw, as far as they are known; of those in a uniform buffer, the rules are checked. Without the
    /// buffer there are none.
    fn cameras(&self, draw: &Draw, faults: &mut Faults) -> Option<Vec<Camera>> {
        let cameras = self.right_cameras(draw, faults)?;
        let before = faults.0.len();
        for camera in &cameras {
            if draw.state.camera_source == CameraSource::UNIFORM_BUFFER {
                depth::check(camera, draw.depth.as_ref(), faults);
            }
            if self.with_attributes && !self.reader.is_part_of_a_picture(camera) {
                camera::check_picture(camera, draw.viewport, faults);
            }
            if faults.0.len() > before {
                return None;
            }
        }
        Some(cameras)
    }

    fn right_cameras(&self, draw: &Draw, faults: &mut Faults) -> Option<Vec<Camera>> {
        if draw.state.camera_source == CameraSource::COMMAND {
            let cameras = draw.cameras.as_deref();
            return Some(cameras.cloned().unwrap_or_default());
        }
        let bytes = match CameraBytes::of(draw, self.reader, faults) {
            CameraBytes::Missing => return None,
            CameraBytes::Unknown => return Some(Vec::new()),
            CameraBytes::Known(bytes) => bytes,
        };
        if let Some(first) = &draw.first_of_set
            && let CameraBytes::Known(of_first) = CameraBytes::of(first, self.reader, &mut Faults::default())
        {
            faults.require(of_first == bytes, "VUID-vkCmdDraw-None-90006", || {
                "the camera in the uniform buffer is another at this draw of a set than at its first one".to_owned()
            });
        }
        let elements = bytes.chunks_exact(CAMERA_BYTES as usize).enumerate();
        let cameras: Vec<_> = elements
            .map(|(index, bytes)| {
                let camera = camera_of(bytes);
                camera::check(&camera, &format!("cameras[{index}] of the uniform buffer"), self.facts, faults);
                draw::check_model(&camera, &draw.state, faults);
                camera
            })
            .collect();
        Some(cameras)
    }

    /// The draws of a command, as far as they are known; their ranges are checked if the command has its numbers from a
    /// buffer.
    fn calls(&self, draw: &Draw, faults: &mut Faults) -> Vec<Call> {
        let Call::Indirect(indirect) = draw.call else {
            return vec![draw.call];
        };
        let mut calls = Vec::new();
        let before = faults.0.len();
        let Some(number) = indirect::number(&indirect, self.reader, faults) else {
            return calls;
        };
        indirect::check_stride(&indirect, number, self.reader, faults);
        if faults.0.len() > before {
            return calls;
        }
        for index in 0..number.min(MOST_DRAWS) {
            let Some(call) = indirect::call(&indirect, index, self.reader) else {
                break;
            };
            indirect::check(&call, self.facts, faults);
            if faults.0.len() == before {
                let size = |buffer| self.reader.size(buffer);
                let ranges = Ranges { pipeline: &draw.pipeline, inputs: &draw.inputs, state: &draw.state, size: &size };
                ranges.check(call, self.facts, faults);
            }
            if faults.0.len() > before {
                break;
            }
            calls.push(call);
        }
        if number as usize == calls.len() {
            indirect::check_all(&calls, self.reader, faults);
        }
        calls
    }
}

/// Bytes of a camera in a uniform buffer.
const CAMERA_BYTES: u64 = size_of::<GaussianCameraDataGAURAST>() as u64;

/// The bytes of a draw's cameras in a uniform buffer.
enum CameraBytes {
    /// There are none, which was said.
    Missing,
    Unknown,
    Known(Vec<u8>),
}

impl CameraBytes {
    fn of(draw: &Draw, reader: &dyn Reader, faults: &mut Faults) -> Self {
        let id = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraBinding-90025";
        let found = match reader.descriptor(draw) {
            None => return Self::Unknown,
            Some(Ok(found)) => found,
            Some(Err(text)) => {
                faults.error(id, text);
                return Self::Missing;
            }
        };
        if !reader.lives(found.buffer, found.serial) {
            faults.error(id, "the buffer of the cameras was destroyed before the submission");
            return Self::Missing;
        }
        let count = u64::from(draw.state.camera_count);
        let size = reader.size(found.buffer).unwrap_or(u64::MAX).saturating_sub(found.offset);
        let range = if found.range == vk::WHOLE_SIZE { size } else { found.range };
        if range < count * CAMERA_BYTES {
            faults.error(
                id,
                format!(
                    "the descriptor of the camera has a range of {range} bytes, but must have {CAMERA_BYTES} times \
                     cameraCount ({count})"
                ),
            );
            return Self::Missing;
        }
        reader.read(found.buffer, found.offset, count * CAMERA_BYTES).map_or(Self::Unknown, Self::Known)
    }
}

/// The cameras of a draw, whatever is wrong with them; none if they are not known.
pub(crate) fn known_cameras(draw: &Draw, reader: &dyn Reader) -> Vec<Camera> {
    if draw.state.camera_source == CameraSource::COMMAND {
        return draw.cameras.as_deref().cloned().unwrap_or_default();
    }
    match CameraBytes::of(draw, reader, &mut Faults::default()) {
        CameraBytes::Known(bytes) => bytes.chunks_exact(CAMERA_BYTES as usize).map(camera_of).collect(),
        CameraBytes::Missing | CameraBytes::Unknown => Vec::new(),
    }
}

/// A hash of all that cameras of the parts of one picture have in common.
pub(crate) fn view_key(camera: &Camera) -> u64 {
    let mut hasher = DefaultHasher::new();
    camera.model.as_raw().hash(&mut hasher);
    camera.eye.map(f64::to_bits).hash(&mut hasher);
    camera.rotation.map(f32::to_bits).hash(&mut hasher);
    camera.focal_length.map(f32::to_bits).hash(&mut hasher);
    hasher.finish()
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
