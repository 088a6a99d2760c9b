//! The generated tables answer as those written by hand do.

use super::{extensions, features, properties, spirv};
use crate::capabilities::features::structures;
use crate::capabilities::{self, limits};
use crate::pnext;
use ash::vk;
use rspirv::spirv::Capability;
use std::collections::BTreeSet;
use std::ffi::c_void;

/// More bytes than any structure of features or properties has.
const SIZE: usize = 1024;

/// A structure of any type: its `sType`, a null `pNext`, and bytes.
#[repr(C, align(8))]
#[derive(Clone, Copy, PartialEq, Debug)]
struct Any {
    s_type: vk::StructureType,
    p_next: *mut c_void,
    words: [u32; SIZE / 4],
}

fn any(s_type: vk::StructureType, word: u32) -> Any {
    Any {
        s_type,
        p_next: std::ptr::null_mut(),
        words: [word; SIZE / 4],
    }
}

/// All types that structures of Vulkan may have: core's and those of a thousand extensions.
fn structure_types() -> impl Iterator<Item = vk::StructureType> {
    (0..100)
        .chain(1_000_000_000..1_001_000_000)
        .filter(|raw| raw % 1000 < 100)
        .map(vk::StructureType::from_raw)
}

/// Counts the structures that both writers fill in, after comparing them.
fn compare(by_hand: impl Fn(pnext::Output<'_>), generated: impl Fn(pnext::Output<'_>)) -> usize {
    let written = |s_type, word, write: &dyn Fn(pnext::Output<'_>)| {
        let mut structure = any(s_type, word);
        // SAFETY: the buffer is as large as any structure, and every bit pattern is one of a word.
        unsafe { pnext::for_each_output((&raw mut structure).cast(), write) };
        structure
    };
    const OTHER: u32 = 0xabab_abab;
    structure_types()
        .filter(|&s_type| {
            // With zeros, since padding may be written or left.
            assert_eq!(
                written(s_type, 0, &by_hand),
                written(s_type, 0, &generated),
                "{s_type:?}"
            );
            let is_written = written(s_type, OTHER, &by_hand) != any(s_type, OTHER);
            let is_generated = written(s_type, OTHER, &generated) != any(s_type, OTHER);
            assert_eq!(is_written, is_generated, "{s_type:?}");
            is_written
        })
        .count()
}

#[test]
fn extensions_are_the_same() {
    let sorted = |list: &[extensions::Extension]| list.iter().copied().collect::<BTreeSet<_>>();
    for (by_hand, generated) in [
        (capabilities::extensions::INSTANCE, extensions::INSTANCE),
        (capabilities::extensions::DEVICE, extensions::DEVICE),
    ] {
        assert_eq!(sorted(by_hand), sorted(generated));
    }
}

#[test]
fn features_are_the_same() {
    let supported = features::SUPPORTED;
    for (name, works) in supported.list() {
        assert_eq!(capabilities::features::is_supported(name), works, "{name}");
    }
    let debug = |features| format!("{features:?}");
    assert_eq!(
        debug(supported.core()),
        debug(capabilities::features::core())
    );
    let count = compare(structures::fill_structure, |out| supported.write(out));
    assert_eq!(count, 40);
}

#[test]
fn requests_are_read_the_same() {
    let mut count = 0;
    for s_type in structure_types() {
        let structure = any(s_type, vk::TRUE);
        // SAFETY: any structure begins like this, and the buffer is as large.
        let structure = unsafe { &*(&raw const structure).cast::<vk::BaseInStructure<'_>>() };
        let mut generated = features::Features::NONE;
        generated.add(structure);
        let generated = names(&generated);
        match structures::requested_in(structure) {
            Some(by_hand) => {
                assert_eq!(by_hand.into_iter().collect::<BTreeSet<_>>(), generated);
                count += 1;
            }
            None => assert!(generated.is_empty(), "{s_type:?}"),
        }
    }
    assert_eq!(count, 40);
}

fn names(features: &features::Features) -> BTreeSet<&'static str> {
    let list = features.list().into_iter();
    list.filter_map(|(name, is_on)| is_on.then_some(name))
        .collect()
}

#[test]
fn properties_are_the_same() {
    let properties: &properties::Properties = limits::generated::properties();
    assert_eq!(
        format!("{:?}", properties.core()),
        format!("{:?}", limits::properties())
    );
    let count = compare(limits::fill_structure, |out| properties.write(out));
    assert_eq!(count, 25);
}

#[test]
fn structures_need_the_same_extensions() {
    for s_type in structure_types() {
        assert_eq!(
            capabilities::features::extension_of(s_type),
            features::extension_of(s_type),
            "{s_type:?}"
        );
    }
}

#[test]
fn core_features_are_read_the_same() {
    let mut requested = features::Features::NONE;
    requested.add_core(&capabilities::features::core());
    let core: BTreeSet<_> = names(&features::SUPPORTED)
        .into_iter()
        .filter(|name| names(&requested).contains(name))
        .collect();
    assert_eq!(core.len(), 37);
}

#[test]
fn mandatory_features_are_those_listed_by_hand() {
    let missing: Vec<_> = features::MANDATORY
        .iter()
        .flat_map(|(_, names)| *names)
        .filter(|name| !capabilities::features::is_supported(name))
        .collect();
    assert_eq!(missing.len(), 5, "{missing:?}");
}

/// Of the capabilities that are translated.
#[test]
fn capabilities_are_the_same() {
    // Vulkan 1.3 needs no feature for these.
    const WITHOUT_FEATURE: [Capability; 4] = [
        Capability::StorageImageExtendedFormats,
        Capability::StorageImageReadWithoutFormat,
        Capability::StorageImageWriteWithoutFormat,
        Capability::ShaderViewportIndexLayerEXT,
    ];
    let properties = limits::generated::properties();
    for capability in (0..0x2000).filter_map(Capability::from_u32) {
        if !crate::shader::is_supported(capability) {
            continue;
        }
        let mut features = BTreeSet::new();
        let mut absent = BTreeSet::new();
        let mut holds = false;
        for enable in spirv::enables(capability) {
            match *enable {
                spirv::Enable::Feature(name, is_on) => {
                    features.insert(name);
                    let works = is_on(&features::SUPPORTED);
                    assert_eq!(works, capabilities::features::is_supported(name));
                }
                spirv::Enable::Property(name, is_there) => {
                    assert!(!name.is_empty());
                    holds |= is_there(properties);
                }
                spirv::Enable::Absent(name) => {
                    absent.insert(name);
                }
            }
        }
        let needed = match (features.is_empty(), holds) {
            (true, false) => absent,
            (_, true) => BTreeSet::new(),
            _ => features,
        };
        let by_hand = capabilities::spirv::needed(capability);
        if WITHOUT_FEATURE.contains(&capability) {
            assert!(needed.is_empty(), "{capability:?}");
        } else {
            let by_hand: BTreeSet<_> = by_hand.iter().copied().collect();
            assert_eq!(by_hand, needed, "{capability:?}");
        }
    }
}
