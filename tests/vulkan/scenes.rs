//! Scenes of all chapters, each named after its subject. Every scene is drawn on this driver, embedded and through the
//! loader, and on lavapipe.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use gaurast_exact::scenes::{ALL, Scene};
use gaurast_runner::{Case, Missing, Need, Variant, ignore, require};
use gaurast_testkit::devices::{lavapipe, own};
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{Difference, differences, for_people, write_differences};
use gaurast_testkit::{Gpu, Output};
use gaurast_tests::triangles::Expected;
use gaurast_workloads::models::Model;

use crate::drivers::loaded;
use crate::rasterization::models;

/// Scenes of files of the test data.
const MODELS: &[Scene] = &[
    Scene { chapter: "rasterization", name: "african_head", draw: models::african_head },
    Scene {
        chapter: "rasterization",
        name: "african_head_of_four_samples",
        draw: models::african_head_of_four_samples,
    },
    Scene { chapter: "rasterization", name: "duck", draw: models::duck },
    Scene { chapter: "rasterization", name: "bunny", draw: models::bunny },
];

/// All scenes.
fn all() -> impl Iterator<Item = &'static Scene> {
    ALL.iter().chain(MODELS)
}

/// The scene of a name.
pub fn find(name: &str) -> Option<&'static Scene> {
    all().find(|scene| scene.name == name)
}

/// Draws a scene, or returns the reason for which it cannot be drawn.
fn try_draw(scene: &Scene, gpu: &Gpu) -> Result<Output, String> {
    match catch_unwind(AssertUnwindSafe(|| (scene.draw)(gpu))) {
        Ok(Ok(output)) => Ok(output),
        Ok(Err(missing)) => Err(missing.to_string()),
        Err(panic) => Err(words(&*panic)),
    }
}

fn words(panic: &dyn Any) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    text.or_else(|| panic.downcast_ref::<&str>().map(ToString::to_string)).unwrap_or_else(|| "a panic".to_owned())
}

/// A variant for each scene.
fn each_scene() -> Vec<Variant> {
    let data = |name| match name {
        "african_head" | "african_head_of_four_samples" => Some(Model::AFRICAN_HEAD),
        "duck" => Some(Model::DUCK),
        "bunny" => Some(Model::BUNNY),
        _ => None,
    };
    let variant = |scene: &Scene| Variant {
        name: scene.name.to_owned(),
        needs: data(scene.name).map(Need::Data).into_iter().collect(),
    };
    all().map(variant).collect()
}

/// This driver draws the same bits embedded and through the loader, and the same picture as lavapipe except for the
/// listed differences.
#[gaurast_runner::test(needs = [GLSLANG, Need::VulkanLoader], each = each_scene())]
fn drivers_agree(case: &Case) {
    let scene = find(case.variant()).expect("a scene");
    let ours = try_draw(scene, own());
    assert_same(&ours, &try_draw(scene, loaded()));
    require(Need::Lavapipe);
    let theirs = match (scene.draw)(lavapipe()) {
        Ok(theirs) => theirs,
        Err(missing) => ignore(Missing::Capability, format!("lavapipe: {missing}")),
    };
    assert!(theirs.shows_something(), "the scene is blank on lavapipe");
    show(scene.name, &ours, &theirs);
    let outcome = judge(scene.name, ours, &theirs);
    match (outcome, Expected::read().unsupported(scene.name)) {
        (Ok(()), None) | (Err(_), Some(_)) => {}
        (Ok(()), Some(listed)) => {
            panic!("it is drawn right: take it off the list of what is not supported ({listed})")
        }
        (Err(reason), None) => panic!("{reason}"),
    }
}

/// Checks that both draw the same bits, or that both fail.
fn assert_same(embedded: &Result<Output, String>, loaded: &Result<Output, String>) {
    let (embedded, loaded) = match (embedded, loaded) {
        (Ok(embedded), Ok(loaded)) => (embedded, loaded),
        (Err(_), Err(_)) => return,
        (Err(reason), Ok(_)) => panic!("embedded: {reason}"),
        (Ok(_), Err(reason)) => panic!("loaded: {reason}"),
    };
    assert_eq!(embedded.pictures.len(), loaded.pictures.len());
    for (embedded, loaded) in embedded.pictures.iter().zip(&loaded.pictures) {
        let is_same = embedded.bytes == loaded.bytes;
        assert!(is_same, "{} differs through the loader", embedded.name);
    }
}

/// Writes both pictures to the folder that `GAURAST_TRIANGLE_PICTURES` names, if it is set.
fn show(name: &str, ours: &Result<Output, String>, theirs: &Output) {
    let Some(folder) = std::env::var_os("GAURAST_TRIANGLE_PICTURES") else {
        return;
    };
    for (who, output) in [("own", ours.as_ref().ok()), ("lavapipe", Some(theirs))] {
        for picture in output.iter().flat_map(|output| &output.pictures) {
            let file = format!("{name}-{}-{who}.png", picture.name.replace(' ', "_"));
            let path = Path::new(&folder).join(file);
            for_people(picture).save(&path).expect("a picture is written");
        }
    }
}

/// Compares this driver's pictures with lavapipe's. The error describes the differences that no exception permits.
fn judge(name: &str, ours: Result<Output, String>, theirs: &Output) -> Result<(), String> {
    let ours = ours?;
    let found = differences(&ours, theirs);
    let expected = Expected::read();
    let is_excused =
        |difference: &Difference| (expected.exceptions(name)).any(|exception| exception.excuses(difference));
    let inexcusable: Vec<_> = (found.into_iter()).filter(|difference| !is_excused(difference)).collect();
    if inexcusable.is_empty() {
        return Ok(());
    }
    let folder = std::env::temp_dir().join("gaurast-differences").join(name);
    let pictures = match write_differences(&folder, &ours, theirs, &inexcusable) {
        Ok(paths) => format!("see {paths:?}"),
        Err(error) => error.to_string(),
    };
    let lines: Vec<_> = inexcusable.iter().map(ToString::to_string).collect();
    Err(format!("{}\n{pictures}", lines.join("\n")))
}

#[gaurast_runner::test]
fn every_listed_name_is_that_of_a_scene() {
    let expected = Expected::read();
    let unknown: Vec<_> = expected.names().filter(|name| find(name).is_none()).collect();
    assert!(unknown.is_empty(), "{unknown:?}");
}
