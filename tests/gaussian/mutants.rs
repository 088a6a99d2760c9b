//! The conformance cases are held to account: a layer makes this driver wrong in one way after another, and a case of the
//! chapter that the table names must fail. The page `docs/mutants.md` is the table of all cases that fail.
//!
//! `GAURAST_BLESS=1`, with `GAURAST_TEST_LONG=1`, has the page written.

use std::collections::BTreeSet;
use std::path::Path;

use gaurast_conformance::features::FEATURES;
use gaurast_conformance::mutants::{Answers, Catch, Extent, catch};
use gaurast_conformance::{Case as Conformance, all, cases};
use gaurast_mutants::MUTANTS;
use gaurast_runner::{Case, Missing, Need, ignore, is_long, shards};
use gaurast_testkit::loader::with_mutants;
use gaurast_tests::oracle::error_model::PrecisionClass;

/// The least number of mutants.
const LEAST: usize = 200;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/mutants.md");

/// Runs each mutant of a shard, and returns what became of them.
fn catches(case: &Case, answers: &Answers, extent: Extent) -> Vec<Catch> {
    let shard = case.shard();
    let own = MUTANTS.iter().enumerate().filter(|(number, _)| shard.has(*number));
    let catches = own.map(|(_, mutant)| catch("loader", mutant, answers, extent));
    catches.map(|caught| caught.unwrap_or_else(|error| panic!("{}", error.0))).collect()
}

/// Each mutant, on its chapter up to the first case that fails: its code is reached, and a case fails.
#[gaurast_runner::test(needs = [Need::VulkanLoader], each = shards(2))]
fn a_case_catches_each_mutant(case: &Case) {
    with_mutants(case, || {
        let faults = catches(case, &Answers::new(all(), None), Extent::UntilCaught);
        let faults: Vec<_> = faults.iter().filter_map(Catch::fault).collect();
        assert!(faults.is_empty(), "{faults:#?}");
    });
}

/// The same with pictures that are held to the relaxed class of precision, in a long run.
#[gaurast_runner::test(needs = [Need::VulkanLoader], each = shards(2))]
fn a_case_catches_each_mutant_at_a_relaxed_precision(case: &Case) {
    if !is_long() {
        ignore(Missing::Capability, "GAURAST_TEST_LONG is not 1");
    }
    with_mutants(case, || {
        let faults = catches(case, &Answers::new(all(), Some(PrecisionClass::Relaxed)), Extent::UntilCaught);
        let faults: Vec<_> = faults.iter().filter_map(Catch::fault).collect();
        assert!(faults.is_empty(), "{faults:#?}");
    });
}

/// Without a mutant, the layer changes nothing: the cases of the chapters that only programs have pass under it.
#[gaurast_runner::test(needs = [Need::VulkanLoader])]
fn the_layer_alone_fails_no_case(case: &Case) {
    use gaurast_conformance::{Device, Outcome, run};
    with_mutants(case, || {
        let device = Device::open_under("loader", &[gaurast_conformance::mutants::LAYER]).expect("a device");
        let chapters = ["draws", "sets", "vertex_input", "views", "passes", "updates", "descriptors", "queries"];
        let mut failures = Vec::new();
        for one in all().iter().filter(|one| chapters.contains(&one.chapter)) {
            if let Outcome::Fail(failure) = run(one, &device, PrecisionClass::Full) {
                failures.push(format!("{}: {}", one.path(), failure.message));
            }
        }
        assert!(failures.is_empty(), "{failures:#?}");
    });
}

/// The head of the page.
const HEAD: &str = "# Mutants

The layer `VK_LAYER_GAURAST_mutants` (`tests/conformance/mutants`) lies between an application and any driver of the extension, and makes
the driver wrong in one way: a _mutant_, which `GAURAST_MUTANT` names. Each must fail a conformance case of its chapter, and a mutant
whose code no case reaches is an error. [conformance.md](conformance.md#mutants) says how to run them.

The table is of this driver. Under _caught by_ are the number of failing cases of the mutant's chapter and the first of them; under
_others_ the failing ones of every tenth case of other chapters. `GAURAST_TEST_LONG=1` runs the tests that make the table and compare
it, and `GAURAST_BLESS=1` has it written.

| mutant | what is wrong | caught by | others |
|---|---|---|---|
";

/// Every mutant on every case of its chapter, and on every tenth of the others.
#[gaurast_runner::test(needs = [Need::VulkanLoader])]
fn the_page_is_what_fails(case: &Case) {
    if !is_long() {
        return the_page_has_every_mutant();
    }
    with_mutants(case, || {
        let answers = Answers::new(all(), None);
        let rows = MUTANTS.iter().map(|mutant| {
            let caught = catch("loader", mutant, &answers, Extent::EveryTenth);
            caught.unwrap_or_else(|error| panic!("{}", error.0)).row() + "\n"
        });
        let page: String = std::iter::once(HEAD.to_owned()).chain(rows).collect();
        if std::env::var_os("GAURAST_BLESS").is_some() {
            std::fs::write(PAGE, &page).expect("the page is written");
        }
        assert_eq!(std::fs::read_to_string(PAGE).expect("the page"), page, "GAURAST_BLESS=1 writes the page");
    });
}

/// The page has a row for each mutant, whose chapter catches it.
fn the_page_has_every_mutant() {
    let page = std::fs::read_to_string(Path::new(PAGE)).expect("the page");
    let table = page.strip_prefix(HEAD).expect("the page begins with its head");
    assert_eq!(table.lines().count(), MUTANTS.len());
    for (row, mutant) in table.lines().zip(MUTANTS) {
        let begin = format!("| `{}` | {} | `{}` ", mutant.name.to_lowercase(), mutant.text, mutant.chapter);
        let count = row.strip_prefix(&begin).and_then(|rest| rest.split(':').next());
        let count: usize =
            count.unwrap_or_else(|| panic!("{row} is not that of {mutant:?}")).parse().expect("a number");
        assert!(count > 0, "{row}");
    }
}

#[gaurast_runner::test]
fn mutants_have_names_and_chapters_of_their_own() {
    assert!(MUTANTS.len() >= LEAST, "{}", MUTANTS.len());
    let names: BTreeSet<_> = MUTANTS.iter().map(|mutant| mutant.name).collect();
    assert_eq!(names.len(), MUTANTS.len(), "two mutants have one name");
    let texts: BTreeSet<_> = MUTANTS.iter().map(|mutant| mutant.text).collect();
    assert_eq!(texts.len(), MUTANTS.len(), "two mutants do the same");
    let chapters: BTreeSet<_> = cases::chapters().collect();
    for mutant in MUTANTS {
        assert!(chapters.contains(mutant.chapter), "{mutant:?}");
    }
}

/// The extension's structure of features has these bits, and each is needed by a case.
#[gaurast_runner::test]
fn each_feature_has_a_case() {
    use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as Features;
    // A type, a pointer, and the bits, which the structure's size rounds up to a multiple of eight bytes.
    assert_eq!((16 + 4 * FEATURES.len()).next_multiple_of(8), size_of::<Features<'_>>());
    let needed: BTreeSet<_> = all().iter().flat_map(Conformance::needs).collect();
    for (name, offered) in FEATURES {
        assert!(needed.contains(name), "no case needs {name}");
        // The name and the bit belong together.
        let all = Features::default();
        assert_eq!(offered(&all), ash::vk::FALSE);
    }
}

/// Each limit has cases: its value, and draws.
#[gaurast_runner::test]
fn each_limit_has_cases() {
    const XML: &str = include_str!("../../api/spec/vk_gaurast.xml");
    let name = "category=\"struct\" name=\"VkPhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST\"";
    let start = XML.find(name).expect("the structure of properties");
    // Types of members end on the lines of the members.
    let structure = &XML[start..][..XML[start..].find("\n        </type>").expect("its end")];
    let members = structure.split("<name>").skip(1).filter_map(|rest| rest.split("</name>").next());
    let members: Vec<_> = members.filter(|name| !["sType", "pNext"].contains(name)).collect();
    assert!(members.len() >= 5, "{members:?}");
    let cases = all();
    for member in members {
        let of_member = cases.iter().filter(|case| case.chapter == "limits" && case.name.starts_with(member));
        assert!(of_member.count() >= 2, "{member} has no case");
    }
}
