//! A device's facts: its enabled features, its limits, and copies of the extension's structures.

use ash::vk;
use gaurast::vk as gvk;

/// A copy of a structure whose chain is cut off.
#[derive(Clone, Copy)]
pub(crate) struct Plain<T>(T);

// SAFETY: `Plain` is made of structures whose only pointer, `pNext`, was set to null.
unsafe impl<T> Send for Plain<T> {}
// SAFETY: as above.
unsafe impl<T> Sync for Plain<T> {}

impl<T> std::ops::Deref for Plain<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T> std::ops::DerefMut for Plain<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.0
    }
}

macro_rules! plain {
    ($($structure:ident),*) => {$(
        impl Plain<gvk::$structure<'static>> {
            /// A copy without the chain.
            pub(crate) fn of(structure: &gvk::$structure<'_>) -> Self {
                let mut copy = gvk::$structure::default();
                let chain = copy.p_next;
                // SAFETY: both are the same structure but for the lifetime of the chain, which is cut off next.
                copy = unsafe { std::mem::transmute_copy(structure) };
                copy.p_next = chain;
                Self(copy)
            }
        }
    )*};
}
plain!(
    PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST,
    PipelineGaussianStateCreateInfoGAURAST,
    GaussianCameraGAURAST,
    GaussianSphericalHarmonicsBufferGAURAST,
    GaussianDecodingTablesGAURAST,
    PipelineGaussianDecodingStateCreateInfoGAURAST
);

/// The features of the extension that are enabled.
pub(crate) type Features = Plain<gvk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST<'static>>;
/// The Gaussian state of a pipeline.
pub(crate) type GaussianState = Plain<gvk::PipelineGaussianStateCreateInfoGAURAST<'static>>;
/// The decodings of a pipeline's attributes.
pub(crate) type Decoding = Plain<gvk::PipelineGaussianDecodingStateCreateInfoGAURAST<'static>>;
/// The tables by which attributes are decoded.
pub(crate) type DecodingTables = Plain<gvk::GaussianDecodingTablesGAURAST<'static>>;
/// A camera.
#[derive(Clone, Copy)]
pub(crate) struct Camera {
    camera: Plain<gvk::GaussianCameraGAURAST<'static>>,
    /// True if its lens distorts.
    pub(crate) distorts: bool,
}

impl Camera {
    /// A copy of a camera, and of what its lens does.
    pub(crate) fn of(
        camera: &gvk::GaussianCameraGAURAST<'_>,
        lens: Option<&gvk::GaussianCameraDistortionGAURAST<'_>>,
    ) -> Self {
        let distorts = lens.is_some_and(|lens| coefficients(lens).any(|coefficient| coefficient != 0.0));
        Self { camera: Plain::<gvk::GaussianCameraGAURAST<'static>>::of(camera), distorts }
    }
}

impl std::ops::Deref for Camera {
    type Target = gvk::GaussianCameraGAURAST<'static>;

    fn deref(&self) -> &Self::Target {
        &self.camera
    }
}

/// All coefficients of a lens: radial ones, tangential ones, those of its thin prism.
pub(crate) fn coefficients(lens: &gvk::GaussianCameraDistortionGAURAST<'_>) -> impl Iterator<Item = f32> {
    lens.radial.into_iter().chain(lens.tangential).chain(lens.thin_prism)
}

/// Harmonics in a buffer.
pub(crate) type Harmonics = Plain<gvk::GaussianSphericalHarmonicsBufferGAURAST<'static>>;

/// The features and limits of a device.
pub(crate) struct Facts {
    /// The extension is enabled.
    pub(crate) has_extension: bool,
    /// Its features that are enabled.
    pub(crate) features: Features,
    /// `maxSphericalHarmonicsDegree`.
    pub(crate) max_degree: u32,
    /// `gaussianSampleCounts`.
    pub(crate) sample_counts: vk::SampleCountFlags,
    /// `maxGaussiansPerDraw`.
    pub(crate) max_gaussians_per_draw: u64,
    /// `maxMultiviewViewCount`.
    pub(crate) max_views: u32,
    /// `multiDrawIndirect`.
    pub(crate) has_multi_draw_indirect: bool,
    /// `drawIndirectFirstInstance`.
    pub(crate) has_first_instance: bool,
    /// The memory types that the host may map, a bit each.
    pub(crate) mappable: u32,
}
