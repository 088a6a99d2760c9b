//! Every scene on both devices.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use gaurast_tests::compare::{Difference, differences, for_people, write_differences};
use gaurast_tests::for_each_scene;
use gaurast_tests::triangles::{Expected, Gpu, Output, Scene, scenes};

use crate::devices::{lavapipe, own};

/// Draws a scene, and says in words why it can't be.
pub fn try_draw(scene: &Scene, gpu: &Gpu) -> Result<Output, String> {
    match catch_unwind(AssertUnwindSafe(|| (scene.draw)(gpu))) {
        Ok(Ok(output)) => Ok(output),
        Ok(Err(missing)) => Err(missing.to_string()),
        Err(panic) => Err(words(&*panic)),
    }
}

fn words(panic: &dyn Any) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    text.or_else(|| panic.downcast_ref::<&str>().map(ToString::to_string))
        .unwrap_or_else(|| "a panic".to_owned())
}

fn check(name: &str) {
    let Some(lavapipe) = lavapipe() else {
        return;
    };
    let scene = scenes::find(name).expect("a scene");
    let theirs = match (scene.draw)(lavapipe) {
        Ok(theirs) => theirs,
        Err(missing) => {
            eprintln!("skipped: lavapipe: {missing}");
            return;
        }
    };
    assert!(theirs.shows_something(), "the scene is blank on lavapipe");
    let ours = try_draw(scene, own());
    show(name, &ours, &theirs);
    let verdict = judge(name, ours, &theirs);
    match (verdict, Expected::read().unsupported(name)) {
        (Ok(()), None) => {}
        (Err(reason), Some(listed)) => eprintln!("not supported yet: {listed} ({reason})"),
        (Ok(()), Some(listed)) => {
            panic!("it is drawn right: take it off the list of what is not supported ({listed})")
        }
        (Err(reason), None) => panic!("{reason}"),
    }
}

/// Writes what both drew to the folder that `GAURAST_TRIANGLE_PICTURES` names, if it does.
fn show(name: &str, ours: &Result<Output, String>, theirs: &Output) {
    let Some(folder) = std::env::var_os("GAURAST_TRIANGLE_PICTURES") else {
        return;
    };
    for (who, output) in [("own", ours.as_ref().ok()), ("lavapipe", Some(theirs))] {
        for picture in output.iter().flat_map(|output| &output.pictures) {
            let file = format!("{name}-{}-{who}.png", picture.name.replace(' ', "_"));
            let path = Path::new(&folder).join(file);
            for_people(picture)
                .save(&path)
                .expect("a picture is written");
        }
    }
}

/// Whether what this driver drew is what lavapipe drew, but for the exceptions.
fn judge(name: &str, ours: Result<Output, String>, theirs: &Output) -> Result<(), String> {
    let ours = ours?;
    let found = differences(&ours, theirs);
    let expected = Expected::read();
    let is_excused = |difference: &Difference| {
        let is = (expected.exceptions(name)).any(|exception| exception.excuses(difference));
        if is {
            println!("excused: {name} | {difference}");
        }
        is
    };
    let stale = expected
        .exceptions(name)
        .find(|exception| !(found.iter()).any(|difference| exception.covers(&difference.picture)));
    // What lavapipe rounds depends on its processor, too.
    if let Some(exception) = stale {
        eprintln!("nothing differs here: {exception:?}");
    }
    let inexcusable: Vec<_> = (found.into_iter())
        .filter(|difference| !is_excused(difference))
        .collect();
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

macro_rules! tests {
    ($($module:ident: $($name:ident),+;)+) => {
        $(mod $module {
            $(#[test]
            fn $name() {
                super::check(stringify!($name));
            })+
        })+
    };
}
for_each_scene!(tests);

#[test]
fn every_listed_name_is_that_of_a_scene() {
    let expected = Expected::read();
    let unknown: Vec<_> = expected
        .names()
        .filter(|name| scenes::find(name).is_none())
        .collect();
    assert!(unknown.is_empty(), "{unknown:?}");
}
