//! Compressed scenes in device memory: their integers, and the tables that say what these stand for.

use ash::vk;
use gaurast::vk::{
    GaussianDecodingGAURAST, GaussianDecodingTableGAURAST, GaussianDecodingTablesGAURAST,
    GaussianHarmonicsCodesGAURAST, GaussianHarmonicsDecodingGAURAST, GaussianHarmonicsLabelsGAURAST,
    GaussianRotationDecodingGAURAST, PipelineGaussianDecodingStateCreateInfoGAURAST,
    PipelineGaussianStateCreateFlagsGAURAST,
};
use gaurast_scene::EncodedScene;
use gaurast_scene::encoded::{Attribute, Decoding, Form};

use crate::resource::Buffer;

/// The layout of a compressed scene's attributes, and what they stand for.
#[derive(Clone)]
pub(crate) struct Encoding {
    /// The strides of the vertex buffers.
    pub(crate) strides: Vec<u32>,
    position: Attribute,
    scale: Attribute,
    rotation: Attribute,
    opacity: Attribute,
    color: Attribute,
    has_signed_log_positions: bool,
    has_logit_opacities: bool,
    has_base_colors: bool,
    harmonics: GaussianHarmonicsDecodingGAURAST,
}

impl Encoding {
    /// The encoding of a scene.
    pub(crate) fn of(scene: &EncodedScene) -> Self {
        let harmonics = match &scene.harmonics {
            None => GaussianHarmonicsDecodingGAURAST::NONE,
            Some(harmonics) if harmonics.labels.is_none() => GaussianHarmonicsDecodingGAURAST::CODEBOOK,
            Some(_) => GaussianHarmonicsDecodingGAURAST::PALETTE,
        };
        Self {
            strides: scene.streams.iter().map(|stream| stream.stride as u32).collect(),
            position: scene.position,
            scale: scene.scale,
            rotation: scene.rotation,
            opacity: scene.opacity,
            color: scene.color,
            has_signed_log_positions: scene.has_signed_log_positions,
            has_logit_opacities: scene.has_logit_opacities,
            has_base_colors: scene.has_base_colors,
            harmonics,
        }
    }

    /// The vertex attributes, from location 0 on: position, scale, rotation, opacity and constant coefficient.
    pub(crate) fn attributes(&self) -> Vec<vk::VertexInputAttributeDescription> {
        let triple = |form: Form| match form {
            Form::Floats => vk::Format::R32G32B32_SFLOAT,
            Form::Bytes => vk::Format::R8G8B8_UINT,
            Form::Shorts => vk::Format::R16G16B16_UINT,
            Form::Word => vk::Format::R32_UINT,
        };
        let rotation = match self.rotation.form {
            Form::Floats => vk::Format::R32G32B32A32_SFLOAT,
            Form::Bytes | Form::Shorts => vk::Format::R8G8B8A8_UINT,
            Form::Word => vk::Format::R32_UINT,
        };
        let opacity = match self.opacity.decoding {
            Decoding::None => vk::Format::R8_UNORM,
            _ => vk::Format::R8_UINT,
        };
        let attributes = [
            (&self.position, triple(self.position.form)),
            (&self.scale, triple(self.scale.form)),
            (&self.rotation, rotation),
            (&self.opacity, opacity),
            (&self.color, triple(self.color.form)),
        ];
        let description = |(location, (attribute, format)): (usize, (&Attribute, vk::Format))| {
            vk::VertexInputAttributeDescription::default()
                .location(location as u32)
                .binding(attribute.stream as u32)
                .offset(attribute.offset as u32)
                .format(format)
        };
        attributes.into_iter().enumerate().map(description).collect()
    }

    /// The activations.
    pub(crate) fn flags(&self) -> PipelineGaussianStateCreateFlagsGAURAST {
        let flags = PipelineGaussianStateCreateFlagsGAURAST::LOG_SCALE;
        if self.has_logit_opacities { flags | PipelineGaussianStateCreateFlagsGAURAST::LOGIT_OPACITY } else { flags }
    }

    /// The decodings of a pipeline that draws harmonics of degree `sh_degree`.
    pub(crate) fn state(&self, sh_degree: u32) -> PipelineGaussianDecodingStateCreateInfoGAURAST<'static> {
        let decoding = |attribute: &Attribute| match attribute.decoding {
            Decoding::None | Decoding::SmallestThree => GaussianDecodingGAURAST::NONE,
            Decoding::Chunks { .. } => GaussianDecodingGAURAST::CHUNK,
            Decoding::Codebook { .. } => GaussianDecodingGAURAST::CODEBOOK,
        };
        let rotation = match self.rotation.form {
            Form::Floats => GaussianRotationDecodingGAURAST::NONE,
            Form::Bytes | Form::Shorts => GaussianRotationDecodingGAURAST::SMALLEST_THREE_8,
            Form::Word => GaussianRotationDecodingGAURAST::SMALLEST_THREE_10,
        };
        let harmonics = if sh_degree == 0 { GaussianHarmonicsDecodingGAURAST::NONE } else { self.harmonics };
        PipelineGaussianDecodingStateCreateInfoGAURAST::default()
            .position(decoding(&self.position))
            .signed_log_position(self.has_signed_log_positions)
            .scale(decoding(&self.scale))
            .rotation(rotation)
            .opacity(decoding(&self.opacity))
            .color(decoding(&self.color))
            .base_color(self.has_base_colors)
            .spherical_harmonics(harmonics)
    }
}

/// The attributes of a compressed scene in device memory.
pub(crate) struct EncodedVertices {
    pub(crate) encoding: Encoding,
    /// A vertex buffer for each stream.
    pub(crate) buffers: Vec<Buffer>,
    pub(crate) tables: Tables,
}

/// The tables of a compressed scene in device memory.
pub(crate) struct Tables {
    /// The scene's numbers, the codes of harmonics, and the entries of the palette that Gaussians have.
    _buffers: [Option<Buffer>; 3],
    /// The places of all tables in them.
    places: GaussianDecodingTablesGAURAST<'static>,
}

impl Tables {
    /// The tables of `scene`, whose bytes are in the buffers.
    pub(crate) fn new(scene: &EncodedScene, numbers: Buffer, codes: Option<Buffer>, labels: Option<Buffer>) -> Self {
        let first = numbers.address();
        let at = |place: usize, stride: usize, chunk_size: usize| {
            const NUMBER: usize = size_of::<f64>();
            GaussianDecodingTableGAURAST::default()
                .device_address(first + (NUMBER * place) as u64)
                .size((NUMBER * (scene.numbers.len() - place)) as u64)
                .format(vk::Format::R64_SFLOAT)
                .stride((NUMBER * stride) as u32)
                .chunk_size(chunk_size as u32)
        };
        let table = |attribute: &Attribute| match attribute.decoding {
            Decoding::None | Decoding::SmallestThree => GaussianDecodingTableGAURAST::default(),
            Decoding::Chunks { table, stride, size } => at(table, stride, size),
            Decoding::Codebook { table } => at(table, 0, 0),
        };
        let mut places = GaussianDecodingTablesGAURAST::default()
            .position(table(&scene.position))
            .scale(table(&scene.scale))
            .opacity(table(&scene.opacity))
            .color(table(&scene.color));
        if let (Some(harmonics), Some(codes)) = (&scene.harmonics, &codes) {
            let of_entries = GaussianHarmonicsCodesGAURAST::default()
                .device_address(codes.address())
                .size(codes.size())
                .stride(harmonics.codes.stride as u32)
                .coefficient_stride(harmonics.coefficient_stride as u32)
                .component_stride(harmonics.component_stride as u32);
            places = places.spherical_harmonics(at(harmonics.codebook, 0, 0)).codes(of_entries);
            if let (Some(stream), Some(labels)) = (&harmonics.labels, &labels) {
                let of_gaussians = GaussianHarmonicsLabelsGAURAST::default()
                    .device_address(labels.address())
                    .size(labels.size())
                    .stride(stream.stride as u32);
                places = places.labels(of_gaussians);
            }
        }
        Self { _buffers: [Some(numbers), codes, labels], places }
    }

    /// The places of all tables.
    pub(crate) fn places(&self) -> &GaussianDecodingTablesGAURAST<'static> {
        &self.places
    }
}
