//! USD with prims of type `ParticleField3DGaussianSplat` (OpenUSD 26.03): as text (`.usda`), binary (`.usdc`), in an archive
//! (`.usdz`), and as `.usd`, which is any of them.
//!
//! Layers that are composed into the file's are looked for in its folder, or in the archive whose first layer it is.

mod binary;
mod composition;
mod gaussians;
mod layer;
mod stage;
mod text;
mod xform;

use super::archive::Archive;
use super::input::{Format, Input, Loaded, Origin};
use crate::error::{Fault, Place, Reason};
use crate::scene::Scene;
use composition::NamedLayer;
use layer::Layer;

/// The format as text.
pub(super) struct Usda;

/// The format as a binary file.
pub(super) struct Usdc;

/// The format in an archive.
pub(super) struct Usdz;

/// The first bytes of a zip archive.
const ZIP_MAGIC: &[u8] = b"PK\x03\x04";

/// Implements a format whose files are recognized by their first bytes.
macro_rules! usd_format {
    ($format:ty, $name:literal, $extensions:expr, $magic:expr) => {
        impl Format for $format {
            fn name(&self) -> &'static str {
                $name
            }

            fn extensions(&self) -> &'static [&'static str] {
                &$extensions
            }

            fn magic(&self) -> Option<&'static [u8]> {
                $magic
            }

            fn has_axes_of_cameras(&self) -> bool {
                false
            }

            fn load(&self, input: &mut Input<'_>) -> Result<Loaded, Fault> {
                let bytes = input.rest()?;
                Ok(load(&bytes, input.origin())?.into())
            }
        }
    };
}

usd_format!(Usda, "USD text", ["usda"], Some(text::MAGIC));
usd_format!(Usdc, "binary USD", ["usdc", "usd"], Some(binary::MAGIC));
// Other formats are zip archives too.
usd_format!(Usdz, "USD archive", ["usdz"], None);

/// Reads the scene of the layer or archive `bytes`.
fn load(bytes: &[u8], origin: Origin<'_>) -> Result<Scene, Fault> {
    if !bytes.starts_with(ZIP_MAGIC) {
        let root = NamedLayer { name: String::new(), layer: layer(bytes)? };
        let beside = |name: &str| match name.strip_suffix(']').and_then(|name| name.split_once('[')) {
            Some((archive, entry)) => named(name, &Archive::new(&origin.companion(archive)?)?.read(entry)?),
            None => named(name, &origin.companion(name)?),
        };
        return stage::scene(&composition::compose(root, &beside)?, origin);
    }
    let archive = Archive::new(bytes)?;
    let name = archive.first();
    let bytes = archive.read(&name)?;
    let within = |fault: Fault| fault.reason.at(Place::Part(format!("entry {name:?}, {}", fault.place)));
    layer(&bytes)
        .and_then(|layer| {
            let root = NamedLayer { name: name.clone(), layer };
            composition::compose(root, &|name| named(name, &archive.read(name)?))
        })
        .and_then(|stage| stage::scene(&stage, origin))
        .map_err(within)
}

/// The layer of the file `name` with the contents `bytes`, or the first one if it is an archive.
fn named(name: &str, bytes: &[u8]) -> Result<NamedLayer, Fault> {
    if !bytes.starts_with(ZIP_MAGIC) {
        return Ok(NamedLayer { name: name.to_owned(), layer: layer(bytes)? });
    }
    let archive = Archive::new(bytes)?;
    let first = archive.first();
    Ok(NamedLayer { name: format!("{name}[{first}]"), layer: layer(&archive.read(&first)?)? })
}

/// The layer `bytes`.
fn layer(bytes: &[u8]) -> Result<Layer, Fault> {
    if bytes.starts_with(text::MAGIC) {
        text::layer(bytes)
    } else if bytes.starts_with(binary::MAGIC) {
        binary::layer(bytes)
    } else {
        Err(Reason::Magic { expected: "a USD file" }.at(Place::Byte(0)))
    }
}
