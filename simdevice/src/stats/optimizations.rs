//! Skips: work that the device leaves out because it changes no pixel. Each has a name, a counter of what it saved and a
//! switch, so that tests prove that the image is the same without it.

use crate::stats::counters::Counter;
use std::str::FromStr;

macro_rules! skips {
    ($($variant:ident: $name:literal, $counter:ident, $description:literal;)*) => {
        /// A kind of work that may be left out.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Skip {
            $(#[doc = $description] $variant,)*
        }

        impl Skip {
            /// Every skip.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// The name that switches know it by.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }

            /// What counts that which it saved; zero while it is off.
            pub fn counter(self) -> Counter {
                match self {
                    $(Self::$variant => Counter::$counter,)*
                }
            }
        }
    };
}

skips! {
    Chunks: "chunks", OutsideByChunks, "Gaussians that are drawn again are in chunks, of which those outside the picture are not read.";
    HiddenChunks: "hidden-chunks", HiddenByOthers, "Gaussians that are drawn again are not read in chunks that others hide.";
    Unchanged: "unchanged", SetsUnchanged, "Gaussians in memory that only the device writes are not projected, sorted and binned again while neither they nor the view change.";
    LastOrder: "last-order", OrdersRepaired, "Gaussians in memory that only the device writes are not sorted where the order of their last picture needs little repair.";
    Bounds: "bounds", OutsideByBounds, "A Gaussian whose bounding sphere is off the screen is not projected further.";
    Ellipse: "ellipse", TilesBesideEllipse, "A Gaussian is listed only in tiles that its ellipse reaches, not in all of its box.";
    Harmonics: "harmonics", HarmonicsUnread, "Spherical harmonics are read only for Gaussians that reach a tile.";
    Bands: "bands", BandsOfZeros, "Degrees of spherical harmonics whose coefficients are zero are not evaluated for Gaussians that are drawn again.";
    Blocks: "blocks", BlocksBesideEllipse, "A Gaussian is evaluated only in blocks of 4x4 pixels that it may reach.";
    Saturated: "saturated", BlocksSaturated, "Nothing is evaluated in blocks and tiles whose pixels are all finished.";
    EmptyTiles: "empty-tiles", TilesUntouched, "Tiles that nothing draws to are neither loaded nor stored.";
    OverwrittenTiles: "overwritten-tiles", TilesOverwritten, "Tiles of colour attachments are neither loaded nor cleared where the first primitive overwrites them as a whole.";
    OverwrittenQuads: "overwritten-quads", QuadsOverwritten, "Quads of tiles that one primitive covers and another of the draw overwrites are not shaded.";
    HiddenTiles: "hidden-tiles", TilesHidden, "A primitive that all depths of a tile hide is not tested there pixel by pixel.";
    MaskedQuads: "masked-quads", QuadsMasked, "Quads of which coverage and early tests leave nothing are not shaded.";
    Affine: "affine", BatchesAffine, "Barycentrics are not divided by 1 / w where that is the same all over each primitive.";
}

/// The skips that a device uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Skips(u32);

/// A name is none of a skip's.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name:?} is neither all nor none nor a skip, which are {}", names())]
pub struct UnknownSkip {
    /// The name.
    pub name: String,
}

fn names() -> String {
    let names: Vec<_> = Skip::ALL.iter().map(|skip| skip.name()).collect();
    names.join(", ")
}

impl Skips {
    /// Every skip.
    pub const ALL: Self = Self((1 << Skip::ALL.len()) - 1);
    /// No skip.
    pub const NONE: Self = Self(0);

    /// Whether `skip` is used.
    #[inline(always)]
    pub fn has(self, skip: Skip) -> bool {
        self.0 >> skip as u32 & 1 == 1
    }

    /// These and `skip`.
    pub fn with(self, skip: Skip) -> Self {
        Self(self.0 | 1 << skip as u32)
    }

    /// These but `skip`.
    pub fn without(self, skip: Skip) -> Self {
        Self(self.0 & !(1 << skip as u32))
    }
}

impl Default for Skips {
    fn default() -> Self {
        Self::ALL
    }
}

impl FromStr for Skips {
    type Err = UnknownSkip;

    /// `all`, `none`, or names of skips, separated by commas; or `all` without some, each after a minus: `all,-blocks`.
    fn from_str(text: &str) -> Result<Self, UnknownSkip> {
        let known = |name: &str| {
            let skip = Skip::ALL.iter().find(|skip| skip.name() == name);
            skip.copied().ok_or_else(|| UnknownSkip {
                name: name.to_owned(),
            })
        };
        match text.split_once(',') {
            None if text == "all" => Ok(Self::ALL),
            None if text == "none" => Ok(Self::NONE),
            Some(("all", without)) => without.split(',').try_fold(Self::ALL, |skips, name| {
                let name = name.strip_prefix('-').unwrap_or("");
                Ok(skips.without(known(name)?))
            }),
            _ => text
                .split(',')
                .try_fold(Self::NONE, |skips, name| Ok(skips.with(known(name)?))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_read_from_their_names() {
        assert_eq!("all".parse(), Ok(Skips::ALL));
        assert_eq!("none".parse(), Ok(Skips::NONE));
        let some: Skips = "blocks,ellipse".parse().unwrap();
        for &skip in Skip::ALL {
            let named = matches!(skip, Skip::Blocks | Skip::Ellipse);
            assert_eq!(some.has(skip), named, "{skip:?}");
            assert!(Skips::default().has(skip));
            assert!(!Skips::ALL.without(skip).has(skip));
            assert_eq!(skip.name().parse(), Ok(Skips::NONE.with(skip)));
        }
        let most = Skips::ALL.without(Skip::Blocks).without(Skip::Bands);
        assert_eq!("all,-blocks,-bands".parse(), Ok(most));
    }

    #[test]
    fn unknown_names_are_told() {
        for text in [
            "",
            "blocks,",
            "every",
            "blocks,all",
            "all,blocks",
            "all,",
            "-blocks",
        ] {
            let error = text.parse::<Skips>().unwrap_err();
            assert!(error.to_string().contains("empty-tiles"), "{error}");
        }
        assert_eq!(
            "blocks,everything"
                .parse::<Skips>()
                .unwrap_err()
                .to_string(),
            "\"everything\" is neither all nor none nor a skip, which are chunks, hidden-chunks, unchanged, last-order, bounds, ellipse, harmonics, bands, blocks, saturated, \
             empty-tiles, overwritten-tiles, overwritten-quads, hidden-tiles, masked-quads, affine"
        );
    }
}
