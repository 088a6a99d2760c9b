//! Optimizations: work that the device omits because it changes no pixel. Each has a name, a counter of the omitted
//! work and a switch. Tests compare images with and without it.

use crate::stats::counters::Counter;
use std::str::FromStr;

macro_rules! optimizations {
    ($($variant:ident: $name:literal, $counter:ident, $description:literal;)*) => {
        /// A kind of work that may be omitted.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Optimization {
            $(#[doc = $description] $variant,)*
        }

        impl Optimization {
            /// Every optimization.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// The name by which switches select it.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }

            /// The counter of the omitted work. It stays zero while the optimization is off.
            pub fn counter(self) -> Counter {
                match self {
                    $(Self::$variant => Counter::$counter,)*
                }
            }
        }
    };
}

optimizations! {
    ClusterCulling: "cluster-culling", OutsideByClusters, "Gaussians that are drawn again are in clusters, of which those outside the picture are not read.";
    OcclusionCulling: "occlusion-culling", HiddenByOthers, "Gaussians that are drawn again are not read in clusters that others hide.";
    TemporalReuse: "temporal-reuse", SetsUnchanged, "Gaussians in memory that only the device writes are not projected, sorted and binned again while neither they nor the view change.";
    Bounds: "bounds", OutsideByBounds, "A Gaussian whose bounding sphere is off the screen is not projected further.";
    Ellipse: "ellipse", TilesBesideEllipse, "A Gaussian is listed only in tiles that its ellipse reaches, not in all of its box.";
    Harmonics: "harmonics", HarmonicsUnread, "Spherical harmonics are read only for Gaussians that reach a tile.";
    Blocks: "blocks", BlocksBesideEllipse, "A Gaussian is evaluated only in blocks of 4x4 pixels that it may reach.";
    EarlyTermination: "early-termination", BlocksSaturated, "Nothing is evaluated in blocks and tiles whose pixels are all finished.";
    EmptyTiles: "empty-tiles", TilesUntouched, "Tiles that nothing draws to are neither loaded nor stored.";
    OverwrittenTiles: "overwritten-tiles", TilesOverwritten, "Tiles of colour attachments are neither loaded nor cleared where the first primitive overwrites them as a whole.";
    OverwrittenQuads: "overwritten-quads", QuadsOverwritten, "Quads of tiles that one primitive covers and another of the draw overwrites are not shaded.";
    HierarchicalDepth: "hierarchical-depth", TilesHidden, "A primitive that all depths of a tile hide is not tested there pixel by pixel.";
    MaskedQuads: "masked-quads", QuadsMasked, "Quads of which coverage and early tests leave nothing are not shaded.";
    Affine: "affine", BatchesAffine, "Barycentrics are not divided by 1 / w where that is the same all over each primitive.";
}

/// The optimizations that a device uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Optimizations(u32);

/// A name that is not the name of an optimization.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name:?} is neither all nor none nor an optimization, which are {}", names())]
pub struct UnknownOptimization {
    /// The name.
    pub name: String,
}

fn names() -> String {
    let names: Vec<_> = Optimization::ALL.iter().map(|optimization| optimization.name()).collect();
    names.join(", ")
}

impl Optimizations {
    /// Every optimization.
    pub const ALL: Self = Self((1 << Optimization::ALL.len()) - 1);
    /// No optimization.
    pub const NONE: Self = Self(0);

    /// True if `optimization` is used.
    #[inline(always)]
    pub fn has(self, optimization: Optimization) -> bool {
        self.0 >> optimization as u32 & 1 == 1
    }

    /// These optimizations and `optimization`.
    pub fn with(self, optimization: Optimization) -> Self {
        Self(self.0 | 1 << optimization as u32)
    }

    /// These optimizations without `optimization`.
    pub fn without(self, optimization: Optimization) -> Self {
        Self(self.0 & !(1 << optimization as u32))
    }
}

impl Default for Optimizations {
    fn default() -> Self {
        Self::ALL
    }
}

impl FromStr for Optimizations {
    type Err = UnknownOptimization;

    /// Reads `all`, `none`, or names of optimizations, separated by commas. `all` may be followed by names with a
    /// minus, which are left out: `all,-blocks`.
    fn from_str(text: &str) -> Result<Self, UnknownOptimization> {
        let known = |name: &str| {
            let optimization = Optimization::ALL.iter().find(|optimization| optimization.name() == name);
            optimization.copied().ok_or_else(|| UnknownOptimization { name: name.to_owned() })
        };
        match text.split_once(',') {
            None if text == "all" => Ok(Self::ALL),
            None if text == "none" => Ok(Self::NONE),
            Some(("all", without)) => without.split(',').try_fold(Self::ALL, |optimizations, name| {
                let name = name.strip_prefix('-').unwrap_or("");
                Ok(optimizations.without(known(name)?))
            }),
            _ => text.split(',').try_fold(Self::NONE, |optimizations, name| Ok(optimizations.with(known(name)?))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[gaurast_runner::test]
    fn sets_are_read_from_their_names() {
        assert_eq!("all".parse(), Ok(Optimizations::ALL));
        assert_eq!("none".parse(), Ok(Optimizations::NONE));
        let some: Optimizations = "blocks,ellipse".parse().unwrap();
        for &optimization in Optimization::ALL {
            let named = matches!(optimization, Optimization::Blocks | Optimization::Ellipse);
            assert_eq!(some.has(optimization), named, "{optimization:?}");
            assert!(Optimizations::default().has(optimization));
            assert!(!Optimizations::ALL.without(optimization).has(optimization));
            assert_eq!(optimization.name().parse(), Ok(Optimizations::NONE.with(optimization)));
        }
        let most = Optimizations::ALL.without(Optimization::Blocks).without(Optimization::Affine);
        assert_eq!("all,-blocks,-affine".parse(), Ok(most));
    }

    #[gaurast_runner::test]
    fn unknown_names_are_told() {
        for text in ["", "blocks,", "every", "blocks,all", "all,blocks", "all,", "-blocks"] {
            let error = text.parse::<Optimizations>().unwrap_err();
            assert!(error.to_string().contains("empty-tiles"), "{error}");
        }
        assert_eq!(
            "blocks,everything".parse::<Optimizations>().unwrap_err().to_string(),
            "\"everything\" is neither all nor none nor an optimization, which are cluster-culling, occlusion-culling, temporal-reuse, bounds, ellipse, harmonics, blocks, early-termination, \
             empty-tiles, overwritten-tiles, overwritten-quads, hierarchical-depth, masked-quads, affine"
        );
    }
}
