//! Attributes that are decoded from integers, and the tables by which they are.

use ash::vk::{self, TaggedStructure};
use gaurast::vk::{
    GaussianDecodingGAURAST as Method, GaussianDecodingTableGAURAST, GaussianDecodingTablesGAURAST,
    GaussianHarmonicsDecodingGAURAST as HarmonicsMethod, GaussianRotationDecodingGAURAST as RotationMethod,
    PipelineGaussianStateCreateFlagsGAURAST as Flags,
};

use crate::facts::{Decoding, Facts, GaussianState};
use crate::objects::Objects;
use crate::recording::Inputs;
use crate::report::Faults;
use crate::rules::state;

/// The attributes that are decoded by the same methods: the name, the method, and the location.
fn methods(state: &GaussianState, decoding: &Decoding) -> [(&'static str, Method, u32); 4] {
    let locations = &state.attribute_locations;
    [
        ("position", decoding.position, locations.position),
        ("scale", decoding.scale, locations.scale),
        ("opacity", decoding.opacity, locations.opacity),
        ("color", decoding.color, locations.first_spherical_harmonics),
    ]
}

/// Reports whether the attribute at a location is decoded.
pub(crate) fn is_decoded(state: &GaussianState, decoding: &Decoding, location: u32) -> bool {
    let by_method = methods(state, decoding).iter().any(|&(_, method, own)| own == location && method != Method::NONE);
    by_method || decoding.rotation != RotationMethod::NONE && state.attribute_locations.rotation == location
}

/// Reports whether a draw needs tables.
fn needs_tables(state: &GaussianState, decoding: &Decoding) -> bool {
    methods(state, decoding).iter().any(|&(_, method, _)| method != Method::NONE)
        || decoding.spherical_harmonics != HarmonicsMethod::NONE
}

/// Checks the decodings of a pipeline that projects by fixed functions; `format` has the format of the attribute at a
/// location.
pub(crate) fn check(
    state: &GaussianState,
    decoding: &Decoding,
    format: impl Fn(u32) -> Option<vk::Format>,
    facts: &Facts,
    faults: &mut Faults,
) {
    if !check_enums(state, decoding, faults) {
        return;
    }
    let is_used = needs_tables(state, decoding) || decoding.rotation != RotationMethod::NONE;
    let id = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-attributeDecoding-90095";
    if is_used && facts.features.attribute_decoding == 0 {
        return faults.error(id, state::absent(id));
    }
    let of_harmonics = decoding.color != Method::NONE || decoding.spherical_harmonics != HarmonicsMethod::NONE;
    faults.require(
        !of_harmonics || !state.flags.contains(Flags::SPHERICAL_HARMONICS_BUFFER),
        "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-color-90098",
        || "color or sphericalHarmonics is decoded, but flags has SPHERICAL_HARMONICS_BUFFER".to_owned(),
    );
    for (name, method, location) in methods(state, decoding) {
        let Some(format) = format(location).filter(|_| method != Method::NONE) else {
            continue;
        };
        faults.require(
            holds_codes(name, method, format),
            "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-position-90096",
            || {
                format!(
                    "{name} is {method:?}, but the format of location {location} is {format:?}, which holds no codes"
                )
            },
        );
    }
    let expected = match decoding.rotation {
        RotationMethod::SMALLEST_THREE_10 => vk::Format::R32_UINT,
        _ => vk::Format::R8G8B8A8_UINT,
    };
    let location = state.attribute_locations.rotation;
    let is_right =
        decoding.rotation == RotationMethod::NONE || format(location).is_none_or(|format| format == expected);
    faults.require(is_right, "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-rotation-90097", || {
        format!("rotation is {:?}, but the format of location {location} is not {expected:?}", decoding.rotation)
    });
}

/// Every enum is a value of its type.
fn check_enums(state: &GaussianState, decoding: &Decoding, faults: &mut Faults) -> bool {
    let ids = [
        "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-position-parameter",
        "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-scale-parameter",
        "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-opacity-parameter",
        "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-color-parameter",
    ];
    let all = ids.into_iter().zip(methods(state, decoding).map(|(_, method, _)| method.as_raw()));
    let others = [
        ("VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-rotation-parameter", decoding.rotation.as_raw()),
        (
            "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-sphericalHarmonics-parameter",
            decoding.spherical_harmonics.as_raw(),
        ),
    ];
    // The values of each of the types are 0, 1 and 2.
    match all.chain(others).find(|(_, raw)| !(0..=2).contains(raw)) {
        None => true,
        Some((id, raw)) => {
            let name = id.split('-').nth(2).unwrap_or(id);
            faults.error(id, format!("{name} is {raw}, which is no value of its type"));
            false
        }
    }
}

/// Reports whether a format may hold the codes of an attribute.
fn holds_codes(name: &str, method: Method, format: vk::Format) -> bool {
    use vk::Format as F;
    let is_chunk = method == Method::CHUNK;
    match format {
        F::R8G8B8_UINT | F::R8G8B8A8_UINT => true,
        F::R16G16B16_UINT | F::R16G16B16A16_UINT => is_chunk,
        F::R8_UINT | F::R8G8_UINT => name == "opacity",
        F::R16_UINT | F::R16G16_UINT => name == "opacity" && is_chunk,
        F::R32_UINT => name == "color" || name != "opacity" && is_chunk,
        _ => false,
    }
}

/// Checks the tables of `vkCmdBindGaussianDecodingTablesGAURAST`.
pub(crate) fn check_tables(tables: &GaussianDecodingTablesGAURAST<'_>, objects: &Objects, faults: &mut Faults) {
    if tables.s_type != GaussianDecodingTablesGAURAST::STRUCTURE_TYPE {
        return faults.error(
            "VUID-VkGaussianDecodingTablesGAURAST-sType-sType",
            format!(
                "pTables->sType is {}, but must be VK_STRUCTURE_TYPE_GAUSSIAN_DECODING_TABLES_GAURAST ({})",
                tables.s_type.as_raw(),
                GaussianDecodingTablesGAURAST::STRUCTURE_TYPE.as_raw()
            ),
        );
    }
    for (name, address, size) in ranges(tables) {
        check_range(name, address, size, objects, faults);
    }
    for (name, table) in numbers(tables) {
        let is_right = matches!(table.format, vk::Format::R32_SFLOAT | vk::Format::R64_SFLOAT);
        faults.require(table.size == 0 || is_right, "VUID-VkGaussianDecodingTableGAURAST-format-90100", || {
            format!(
                "the format of {name} is {:?}, but must be VK_FORMAT_R32_SFLOAT or VK_FORMAT_R64_SFLOAT",
                table.format
            )
        });
    }
}

/// The tables of numbers by their names.
fn numbers(tables: &GaussianDecodingTablesGAURAST<'_>) -> [(&'static str, GaussianDecodingTableGAURAST); 5] {
    [
        ("position", tables.position),
        ("scale", tables.scale),
        ("opacity", tables.opacity),
        ("color", tables.color),
        ("sphericalHarmonics", tables.spherical_harmonics),
    ]
}

/// All tables by their names: their addresses and sizes.
pub(crate) fn ranges(tables: &GaussianDecodingTablesGAURAST<'_>) -> Vec<(&'static str, u64, u64)> {
    let numbers = numbers(tables).map(|(name, table)| (name, table.device_address, table.size));
    let codes = ("codes", tables.codes.device_address, tables.codes.size);
    let labels = ("labels", tables.labels.device_address, tables.labels.size);
    numbers.into_iter().chain([codes, labels]).filter(|&(_, _, size)| size > 0).collect()
}

fn check_range(name: &str, address: u64, size: u64, objects: &Objects, faults: &mut Faults) {
    let id = "VUID-VkGaussianDecodingTableGAURAST-deviceAddress-90099";
    let Some((_, buffer)) = objects.buffer_at(address) else {
        let text = "which is within no buffer whose address was asked for";
        return faults.error(id, format!("the deviceAddress of {name} is {address:#x}, {text}"));
    };
    let has = buffer.size - (address - buffer.address.unwrap_or_default());
    faults.require(size <= has, id, || {
        format!("the size of {name} is {size}, but the buffer has {has} bytes from its deviceAddress on")
    });
}

/// Checks that a draw's tables are bound.
pub(crate) fn check_draw(state: &GaussianState, decoding: &Decoding, inputs: &Inputs, faults: &mut Faults) {
    if !state::is_fixed(state) || !needs_tables(state, decoding) {
        return;
    }
    let id = "VUID-vkCmdDraw-attributeDecoding-90101";
    let Some(bound) = &inputs.decoding_tables else {
        let text = "attributes are decoded, but vkCmdBindGaussianDecodingTablesGAURAST has bound no tables";
        return faults.error(id, text);
    };
    let sizes = numbers(&bound.tables).map(|(_, table)| table.chunk_size);
    for ((name, method, _), size) in methods(state, decoding).into_iter().zip(sizes) {
        faults.require(method != Method::CHUNK || size != 0, id, || {
            format!("{name} is CHUNK, but chunkSize is 0 in its table")
        });
    }
}
