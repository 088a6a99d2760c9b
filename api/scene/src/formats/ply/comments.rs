//! Metadata in the comments of a PLY header, which training programs write.
//!
//! nerfstudio and Brush write `Vertical Axis: z`, or another axis. Brush writes `SplatRenderMode: default`, `mip` or `2dgs`; Postshot `antialiased 0` or `1`. Case does not matter, and
//! the last of them counts.

use crate::axes::{Axes, AxesReason, FileAxes};
use crate::metadata::{Antialiasing, Geometry, Metadata};

/// The metadata in `comments`, each without its keyword.
pub(super) fn metadata(comments: &[String]) -> Metadata {
    let mut metadata = Metadata::default();
    for comment in comments {
        let comment = comment.to_ascii_lowercase();
        if let Some(axis) = comment.strip_prefix("vertical axis:") {
            let axes = Axes::with_vertical(axis);
            // Axes as all PLY files of 3DGS have them are not worth a word.
            let turned = axes.filter(|axes| *axes != Axes::RIGHT_DOWN_FRONT);
            metadata.axes = turned.map(|axes| FileAxes { axes, reason: AxesReason::File, of_cameras: true });
            if axes.is_none() {
                metadata.note(format!("the vertical axis {:?} is none, and is ignored", axis.trim()));
            }
        }
        let statement = if let Some(mode) = comment.strip_prefix("splatrendermode:") {
            match mode.trim() {
                "default" => Some((Antialiasing::Off, Geometry::Volume)),
                "mip" => Some((Antialiasing::Compensated, Geometry::Volume)),
                "2dgs" => Some((Antialiasing::Off, Geometry::Surfel)),
                other => {
                    metadata.note(format!("the render mode {other:?} is unknown and ignored"));
                    None
                }
            }
        } else if let Some(flag) = comment.strip_prefix("antialiased ") {
            match flag.trim() {
                "0" => Some((Antialiasing::Off, Geometry::Volume)),
                "1" => Some((Antialiasing::Compensated, Geometry::Volume)),
                _ => None,
            }
        } else {
            None
        };
        if let Some((antialiasing, geometry)) = statement {
            metadata.antialiasing = Some(antialiasing);
            metadata.geometry = Some(geometry);
        }
    }
    metadata
}
