//! Metadata in the comments of a PLY header, which training programs write.
//!
//! Brush writes `SplatRenderMode: default`, `mip` or `2dgs`; Postshot `antialiased 0` or `1`. Case does not matter, and
//! the last of them counts.

use crate::metadata::{Antialiasing, Geometry, Metadata};

/// The metadata in `comments`, each without its keyword.
pub(super) fn metadata(comments: &[String]) -> Metadata {
    let mut metadata = Metadata::default();
    for comment in comments {
        let comment = comment.to_ascii_lowercase();
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
