//! `VK_LAYER_GAURAST_validation`, through the loader, over this driver: a table of mistakes, each of which it names by one
//! message and no other; right uses, of which it says nothing; and samples. `VK_LAYER_GAURAST_emulation`, over lavapipe.
//!
//! `unsafe` here has one reason throughout: these are Vulkan calls, and each test follows Vulkan's valid usage or breaks it in
//! the one way that it is about, which the driver survives.

mod before;
mod cameras;
mod contents;
mod decoding;
mod depth;
mod devices;
mod draws;
mod dynamic_states;
mod emulation;
mod features;
mod harmonics;
mod indirect;
mod libraries;
mod lifetimes;
mod locations;
mod page;
mod pipelines;
mod resolve;
mod right;
mod samples;
mod sets;
mod shaders;
mod stage;

use std::collections::{BTreeMap, BTreeSet};

use gaurast_runner::{Case, Need, Variant};
use gaurast_testkit::loader::{LAYER, strictly_with_the_layer, with_the_layer};
use gaurast_testkit::{Driver, Gpu, Opening};

use crate::stage::{Mistake, Stage, said_by_the_driver, said_by_the_layer};

const SPECIFICATION: &str = include_str!("../../api/spec/VK_GAURAST_gaussian_primitive_topology.adoc");

/// The least number of mistakes.
const LEAST: usize = 190;

/// The statements of the specification that no layer can see broken, each with the reason. All can be seen, at least in part:
/// what a shader writes to a buffer, and what an indirect draw's later draws read, is not.
const INVISIBLE: &[(&str, &str)] = &[];

/// The right uses that end the program within the Khronos layer: version 1.3.239 throws at the first dynamic state that it does
/// not know.
const BEYOND_KHRONOS: &[&str] = &["dynamic states"];

/// The mistakes by chapter.
pub fn chapters() -> Vec<(&'static str, Vec<Mistake>)> {
    vec![
        ("Devices", devices::mistakes()),
        ("Pipelines", pipelines::mistakes()),
        ("Locations of attributes", locations::mistakes()),
        ("Shaders", shaders::mistakes()),
        ("Features that are not enabled", features::mistakes()),
        ("Cameras", cameras::mistakes()),
        ("Dynamic states", dynamic_states::mistakes()),
        ("Sorted sets", sets::mistakes()),
        ("Harmonics in a buffer", harmonics::mistakes()),
        ("Decoded attributes", decoding::mistakes()),
        ("Draws", draws::mistakes()),
        ("Depths", depth::mistakes()),
        ("Numbers in buffers", indirect::mistakes()),
        ("Pipeline libraries", libraries::mistakes()),
        ("Lifetimes", lifetimes::mistakes()),
        ("What buffers hold", contents::mistakes()),
    ]
}

/// The ids of the specification's statements.
fn stated() -> BTreeSet<&'static str> {
    let is_of_id = |c: char| c.is_ascii_alphanumeric() || c == '-';
    let candidates = SPECIFICATION.split(|c: char| !is_of_id(c));
    candidates.filter(|id| id.starts_with("VUID-")).collect()
}

#[gaurast_runner::test]
fn every_statement_has_a_mistake_or_a_reason() {
    let chapters = chapters();
    let mistakes: Vec<_> = chapters.iter().flat_map(|(_, mistakes)| mistakes).collect();
    assert!(mistakes.len() >= LEAST, "{}", mistakes.len());
    let names: BTreeSet<_> = mistakes.iter().map(|mistake| mistake.name).collect();
    assert_eq!(names.len(), mistakes.len(), "two mistakes have one name");
    let made: BTreeSet<_> = mistakes.iter().map(|mistake| mistake.id).collect();
    let reasons: BTreeSet<_> = INVISIBLE.iter().map(|(id, _)| *id).collect();
    let stated = stated();
    assert!(stated.len() > 70, "{}", stated.len());
    let forgotten: Vec<_> = stated.iter().filter(|id| !made.contains(*id) && !reasons.contains(*id)).collect();
    assert!(forgotten.is_empty(), "no mistake breaks {forgotten:#?}");
    let both: Vec<_> = reasons.iter().filter(|id| made.contains(*id)).collect();
    assert!(both.is_empty(), "{both:?} can be seen");
}

/// Each mistake is made; the page of all is what the layer and the driver say.
#[gaurast_runner::test(needs = [Need::VulkanLoader])]
fn each_mistake_has_its_message_and_no_other(case: &Case) {
    strictly_with_the_layer(case, || {
        let stage = Stage::new();
        let mut wrong = Vec::new();
        let mut rows = Vec::new();
        for (chapter, mistakes) in chapters() {
            for mistake in mistakes {
                let heard = (mistake.make)(&stage);
                let of_layer = said_by_the_layer(&heard);
                if of_layer.len() != 1 || of_layer[0].id != mistake.id {
                    wrong.push((mistake.name, mistake.id, of_layer));
                    continue;
                }
                let of_driver = said_by_the_driver(&heard).into_iter().next();
                rows.push((chapter, mistake.name, of_driver, of_layer[0].clone()));
            }
        }
        assert!(wrong.is_empty(), "{wrong:#?}");
        page::check(&rows);
    });
}

/// This layer alone, and with the Khronos layer below it.
fn layers() -> Vec<Variant> {
    let both = Variant { name: "with VK_LAYER_KHRONOS_validation".to_owned(), needs: vec![Need::ValidationLayer] };
    vec![Variant::new("alone"), both]
}

#[gaurast_runner::test(needs = [Need::VulkanLoader], each = layers())]
fn nothing_is_said_of_right_uses(case: &Case) {
    with_the_layer(case, Some(samples::settings()), || {
        let names = [LAYER, c"VK_LAYER_KHRONOS_validation"];
        let layers = if case.variant() == "alone" { &names[..1] } else { &names[..] };
        let opening = Opening { layers, all_extensions: true, robust: true, ..Opening::of(Driver::Loaded) };
        let gpu = Gpu::open(&opening).expect("a device");
        let at_first = gpu.messages();
        assert!(said_by_the_layer(&at_first).is_empty(), "{at_first:#?}");
        let mut wrong = BTreeMap::new();
        for (name, use_it) in right::uses() {
            if layers.len() > 1 && BEYOND_KHRONOS.contains(&name) {
                continue;
            }
            let mut heard = use_it(&gpu);
            // The testkit keeps every image in one layout, which the Khronos layer gives advice about.
            heard.retain(|message| !message.text.contains("For optimal performance"));
            if !heard.is_empty() {
                wrong.insert(name, heard);
            }
        }
        assert!(wrong.is_empty(), "{wrong:#?}");
    });
}

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
