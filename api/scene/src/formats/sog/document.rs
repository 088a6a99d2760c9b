//! The JSON documents of SOG: their names, and reading them.

use serde::Deserialize;

use crate::error::{Fault, Place, Reason};
use crate::formats::spz::one_line;

/// The name of a scene's document.
pub(in crate::formats) const META: &str = "meta.json";

/// The name of a streamed scene's document.
pub(in crate::formats) const STREAMED_META: &str = "lod-meta.json";

/// The JSON document `text`.
pub(super) fn parse<'a, T: Deserialize<'a>>(text: &'a [u8], place: Place) -> Result<T, Fault> {
    serde_json::from_slice(text).map_err(|error| Reason::Json(one_line(&error)).at(place))
}
