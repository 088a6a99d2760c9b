//! Mistakes with attributes that are decoded.

use ash::vk;
use gaurast::vk::{
    GaussianDecodingGAURAST as Decoding, GaussianDecodingTableGAURAST, GaussianDecodingTablesGAURAST,
    GaussianHarmonicsDecodingGAURAST as HarmonicsDecoding, GaussianRotationDecodingGAURAST as RotationDecoding,
    PipelineGaussianDecodingStateCreateInfoGAURAST, PipelineGaussianStateCreateFlagsGAURAST as Flags,
};
use gaurast_testkit::{Gpu, Graphics, Message};

use crate::harmonics::Addressed;
use crate::stage::{Mistake, SPLAT, Stage, camera, drawing, gaussian, mistake, pipeline, recording, splats, with};

type State = PipelineGaussianDecodingStateCreateInfoGAURAST<'static>;
type Tables = GaussianDecodingTablesGAURAST<'static>;

/// A pipeline with decodings, whose attribute at a location has a format.
pub fn decoded(location: u32, format: vk::Format, change: impl FnOnce(State) -> State) -> Graphics<'static> {
    let mut request = splats();
    let attributes = request.attributes.iter_mut().filter(|attribute| attribute.location == location);
    attributes.for_each(|attribute| attribute.format = format);
    Graphics { decoding: Some(change(State::default())), ..request }
}

/// Positions in words.
pub fn words() -> Graphics<'static> {
    decoded(0, vk::Format::R32_UINT, |state| state.position(Decoding::CHUNK))
}

/// Bounds of one chunk of positions.
pub fn tables(buffer: &Addressed) -> Tables {
    let table = GaussianDecodingTableGAURAST::default()
        .device_address(buffer.address)
        .size(24)
        .format(vk::Format::R32_SFLOAT)
        .stride(24)
        .chunk_size(256);
    Tables::default().position(table)
}

/// Records a binding of tables.
pub fn bind(gpu: &Gpu, commands: vk::CommandBuffer, tables: &Tables) {
    // SAFETY: see the crate.
    unsafe { gaussian(gpu).cmd_bind_gaussian_decoding_tables(commands, tables) };
}

fn binds(name: &'static str, id: &'static str, change: fn(Tables) -> Tables) -> Mistake {
    mistake(name, id, move |stage| {
        let gpu = &stage.full;
        let buffer = Addressed::new(gpu, 256);
        recording(gpu, |commands| bind(gpu, commands.raw, &change(tables(&buffer))))
    })
}

/// The messages of a draw of words, after tables may have been bound.
fn draws(stage: &Stage, bound: Option<fn(Tables) -> Tables>) -> Vec<Message> {
    let gpu = &stage.full;
    let buffer = Addressed::new(gpu, 256);
    drawing(gpu, &words(), &[SPLAT], |commands| {
        if let Some(change) = bound {
            bind(gpu, commands.raw, &change(tables(&buffer)));
        }
        commands.camera(&camera());
        commands.draw(0..1);
    })
}

pub fn mistakes() -> Vec<Mistake> {
    let format = "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-position-90096";
    let rotation = "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-rotation-90097";
    let harmonics = "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-color-90098";
    let address = "VUID-VkGaussianDecodingTableGAURAST-deviceAddress-90099";
    let unbound = "VUID-vkCmdDraw-attributeDecoding-90101";
    vec![
        pipeline("codes of positions that are floats", format, || {
            decoded(0, vk::Format::R32G32B32_SFLOAT, |state| state.position(Decoding::CHUNK))
        }),
        pipeline("numbers of 16 bits in a codebook", format, || {
            decoded(1, vk::Format::R16G16B16_UINT, |state| state.scale(Decoding::CODEBOOK))
        }),
        pipeline("an opacity in a word", format, || {
            decoded(3, vk::Format::R32_UINT, |state| state.opacity(Decoding::CHUNK))
        }),
        pipeline("a colour of two codes", format, || {
            decoded(4, vk::Format::R8G8_UINT, |state| state.color(Decoding::CODEBOOK))
        }),
        pipeline("a rotation of 10 bits in bytes", rotation, || {
            decoded(2, vk::Format::R8G8B8A8_UINT, |state| state.rotation(RotationDecoding::SMALLEST_THREE_10))
        }),
        pipeline("codes of harmonics, and a buffer of harmonics", harmonics, || Graphics {
            decoding: Some(State::default().spherical_harmonics(HarmonicsDecoding::PALETTE)),
            ..with(|s| s.flags(Flags::SPHERICAL_HARMONICS_BUFFER))
        }),
        pipeline(
            "a decoding of positions that is none",
            "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-position-parameter",
            || decoded(0, vk::Format::R32_UINT, |state| state.position(Decoding::from_raw(77))),
        ),
        pipeline(
            "a decoding of rotations that is none",
            "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-rotation-parameter",
            || decoded(2, vk::Format::R32_UINT, |state| state.rotation(RotationDecoding::from_raw(77))),
        ),
        mistake(
            "decoded attributes without their feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-attributeDecoding-90095",
            |stage| crate::stage::creation(&stage.bare, &words()),
        ),
        binds("a table that is longer than its buffer", address, |mut tables| {
            tables.position.size = 257;
            tables
        }),
        binds("a table at an address of no buffer", address, |mut tables| {
            tables.position.device_address = 0;
            tables
        }),
        binds("labels at an address of no buffer", address, |mut tables| {
            tables.labels.size = 2;
            tables
        }),
        binds("a table of halves", "VUID-VkGaussianDecodingTableGAURAST-format-90100", |mut tables| {
            tables.position.format = vk::Format::R16_SFLOAT;
            tables
        }),
        binds(
            "the structure's type of the tables was not set",
            "VUID-VkGaussianDecodingTablesGAURAST-sType-sType",
            |mut tables| {
                tables.s_type = vk::StructureType::APPLICATION_INFO;
                tables
            },
        ),
        mistake("a draw of codes without tables", unbound, |stage| draws(stage, None)),
        mistake("chunks of no Gaussians", unbound, |stage| {
            draws(
                stage,
                Some(|mut tables| {
                    tables.position.chunk_size = 0;
                    tables
                }),
            )
        }),
    ]
}
