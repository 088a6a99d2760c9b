//! Camera tracks of viewers: SuperSplat's documents and the settings of its exports, and LichtFeld Studio's timelines.

use glam::{DQuat, DVec3};
use serde::Deserialize;

use crate::camera::Model;
use crate::camera_path::Keyframe;

/// The frames of a second, where a file gives none.
const FRAME_RATE: f64 = 30.0;

/// Half the height in millimetres of the sensor to which LichtFeld Studio's focal lengths belong.
const HALF_SENSOR: f64 = 12.0;

/// Reads the keyframes of a camera track, for pictures of `size`. There are none if the file is of no known kind.
///
/// SuperSplat's world is 3DGS's turned by half a turn about z, LichtFeld Studio's by half a turn about x.
///
/// # Errors
/// If it is not JSON, or not of this shape.
pub fn parse(text: &str, size: [u32; 2]) -> Result<Vec<Keyframe>, serde_json::Error> {
    let track: Track = serde_json::from_str(text)?;
    let mut keyframes = if let Some(keyframes) = &track.keyframes {
        keyframes.iter().map(LichtFeldKeyframe::keyframe).collect()
    } else if let Some(set) = track.pose_sets.first() {
        let rate = track.timeline.frame_rate.unwrap_or(FRAME_RATE);
        let poses = set.poses.iter().enumerate();
        poses.map(|(index, pose)| pose.keyframe(pose.frame.map_or(index as f64, |frame| frame / rate), size)).collect()
    } else if let Some(animation) = track.animation_tracks.first() {
        animation.keyframes(size)
    } else if !track.cameras.is_empty() {
        track.cameras.iter().enumerate().map(|(index, camera)| camera.initial.keyframe(index as f64, size)).collect()
    } else {
        track.camera.iter().filter_map(LoneCamera::pose).map(|pose| pose.keyframe(0.0, size)).collect()
    };
    let time = |keyframe: &Keyframe| keyframe.time.unwrap_or_default();
    keyframes.sort_by(|a, b| time(a).total_cmp(&time(b)));
    Ok(keyframes)
}

/// A file of any of the kinds.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Track {
    /// LichtFeld Studio's.
    keyframes: Option<Vec<LichtFeldKeyframe>>,
    /// The tracks of SuperSplat's document.
    #[serde(default)]
    pose_sets: Vec<PoseSet>,
    #[serde(default)]
    timeline: Timeline,
    /// The tracks of the settings of SuperSplat's viewer.
    #[serde(default, rename = "animTracks")]
    animation_tracks: Vec<AnimationTrack>,
    #[serde(default)]
    cameras: Vec<SettingsCamera>,
    /// The one camera of the viewer's first settings.
    camera: Option<LoneCamera>,
}

/// The camera of the first version of the settings of SuperSplat's viewer. A document has one without a position.
#[derive(Deserialize)]
struct LoneCamera {
    position: Option<[f64; 3]>,
    target: Option<[f64; 3]>,
    fov: Option<f64>,
}

impl LoneCamera {
    fn pose(&self) -> Option<Pose> {
        let fov = self.fov.unwrap_or_else(default_fov);
        Some(Pose { frame: None, position: self.position?, target: self.target?, fov })
    }
}

#[derive(Deserialize)]
struct PoseSet {
    poses: Vec<Pose>,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Timeline {
    frame_rate: Option<f64>,
}

#[derive(Deserialize)]
struct SettingsCamera {
    initial: Pose,
}

/// A camera of SuperSplat.
#[derive(Deserialize)]
struct Pose {
    frame: Option<f64>,
    position: [f64; 3],
    target: [f64; 3],
    /// The field of view of the picture's longer side, in degrees.
    #[serde(default = "default_fov")]
    fov: f64,
}

/// SuperSplat's own.
fn default_fov() -> f64 {
    60.0
}

impl Pose {
    fn keyframe(&self, time: f64, [width, height]: [u32; 2]) -> Keyframe {
        let turned = |[x, y, z]: [f64; 3]| [-x, -y, z];
        let part = f64::from(height) / f64::from(width.max(height));
        let half = libm::tan(self.fov.to_radians() / 2.0) * part;
        Keyframe {
            eye: turned(self.position),
            target: turned(self.target),
            up: turned([0.0, 1.0, 0.0]),
            fov: 2.0 * libm::atan(half).to_degrees(),
            camera: Model::Pinhole,
            time: Some(time),
        }
    }
}

/// A track of the settings of SuperSplat's viewer.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct AnimationTrack {
    frame_rate: Option<f64>,
    keyframes: AnimationKeyframes,
}

/// Parallel lists: times in frames, three numbers of each position and target, fields of view.
#[derive(Deserialize)]
struct AnimationKeyframes {
    times: Vec<f64>,
    values: AnimationValues,
}

#[derive(Deserialize)]
struct AnimationValues {
    position: Vec<f64>,
    target: Vec<f64>,
    #[serde(default)]
    fov: Vec<f64>,
}

impl AnimationTrack {
    fn keyframes(&self, size: [u32; 2]) -> Vec<Keyframe> {
        let AnimationKeyframes { times, values } = &self.keyframes;
        let rate = self.frame_rate.unwrap_or(FRAME_RATE);
        let points = values.position.as_chunks::<3>().0.iter().zip(values.target.as_chunks::<3>().0);
        let views = times.iter().zip(points).enumerate();
        views
            .map(|(index, (time, (position, target)))| {
                let fov = values.fov.get(index).copied().unwrap_or_else(default_fov);
                Pose { frame: None, position: *position, target: *target, fov }.keyframe(time / rate, size)
            })
            .collect()
    }
}

/// A keyframe of LichtFeld Studio, whose camera looks along -z with y upwards.
#[derive(Deserialize)]
struct LichtFeldKeyframe {
    /// In seconds.
    time: f64,
    position: [f64; 3],
    /// The quaternion w, x, y, z from camera to world.
    rotation: [f64; 4],
    /// In millimetres.
    focal_length_mm: f64,
}

impl LichtFeldKeyframe {
    fn keyframe(&self) -> Keyframe {
        let [w, x, y, z] = self.rotation;
        let rotation = DQuat::from_xyzw(x, y, z, w).normalize();
        let turned = |vector: DVec3| DVec3::new(vector.x, -vector.y, -vector.z);
        let eye = turned(DVec3::from_array(self.position));
        Keyframe {
            eye: eye.into(),
            target: (eye + turned(rotation * DVec3::NEG_Z)).into(),
            up: turned(rotation * DVec3::Y).into(),
            fov: 2.0 * libm::atan(HALF_SENSOR / self.focal_length_mm).to_degrees(),
            camera: Model::Pinhole,
            time: Some(self.time),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that the keyframe looks from (1, 2, 3) along +z of scenes, with -y upwards.
    #[track_caller]
    fn check(keyframe: &Keyframe, size: [u32; 2], focal: f64) {
        let camera = keyframe.camera(size).expect("a camera");
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{camera:?}");
        camera.eye.iter().zip([1.0, 2.0, 3.0]).for_each(|(a, b)| close(*a, b));
        let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        camera.rotation.as_flattened().iter().zip(identity).for_each(|(a, b)| close(*a, b));
        close(camera.focal[1], focal);
    }

    #[test]
    fn supersplats_documents_are_turned_about_z() {
        let text = r#"{"timeline": {"frames": 180, "frameRate": 10, "smoothness": 1},
            "camera": {"fov": 70}, "poseSets": [{"name": "set0", "poses": [
            {"name": "b", "frame": 30, "position": [-1, -2, 3], "target": [-1, -2, 5], "fov": 90},
            {"name": "a", "frame": 0, "position": [0, 0, 0], "target": [0, 0, 1], "fov": 60}]}]}"#;
        let keyframes = parse(text, [200, 100]).expect("a track");
        assert_eq!(keyframes.iter().map(|frame| frame.time).collect::<Vec<_>>(), [Some(0.0), Some(3.0)]);
        // The angle is that of the longer side.
        check(&keyframes[1], [200, 100], 100.0);
        let upright = parse(text, [100, 200]).expect("a track");
        check(&upright[1], [100, 200], 100.0);
    }

    #[test]
    fn settings_of_supersplats_viewer_have_parallel_lists() {
        let text = r#"{"version": 2, "cameras": [], "animTracks": [{"name": "t", "duration": 6, "frameRate": 30,
            "loopMode": "repeat", "interpolation": "spline", "keyframes": {"times": [0, 60], "values": {
            "position": [0, 0, 0, -1, -2, 3], "target": [0, 0, 1, -1, -2, 9], "fov": [60, 90]}}}]}"#;
        let keyframes = parse(text, [100, 100]).expect("a track");
        assert_eq!(keyframes[1].time, Some(2.0));
        check(&keyframes[1], [100, 100], 50.0);
        let text = r#"{"version": 2, "animTracks": [], "cameras": [{"initial":
            {"position": [-1, -2, 3], "target": [-1, -2, 4], "fov": 90}}]}"#;
        check(&parse(text, [100, 100]).expect("a camera")[0], [100, 100], 50.0);
        let first = r#"{"camera": {"fov": 90, "position": [-1, -2, 3], "target": [-1, -2, 4], "startAnim": "none"},
            "background": {"color": [0, 0, 0]}, "animTracks": []}"#;
        check(&parse(first, [100, 100]).expect("a camera")[0], [100, 100], 50.0);
        let nowhere = first.replace("[-1, -2, 3]", "null");
        assert!(parse(&nowhere, [100, 100]).expect("settings").is_empty());
    }

    #[test]
    fn lichtfelds_timelines_are_turned_about_x() {
        let text = r#"{"version": 4, "clip_duration": 30.0, "keyframes": [{"time": 1.5, "position": [1, -2, -3],
            "rotation": [2, 0, 0, 0], "focal_length_mm": 24, "easing": 0}]}"#;
        let keyframes = parse(text, [300, 200]).expect("a track");
        assert_eq!(keyframes[0].time, Some(1.5));
        check(&keyframes[0], [300, 200], 200.0);
    }

    #[test]
    fn other_files_have_no_keyframes() {
        assert!(parse("{}", [1, 1]).expect("JSON").is_empty());
        assert!(parse("[", [1, 1]).is_err());
        assert!(parse(r#"{"keyframes": [{"time": 1}]}"#, [1, 1]).is_err());
    }
}
