//! Out-of-memory tests. Allocations whose size depends on an application fail, one in each run. Each time the
//! application gets an out-of-memory result, or its device is lost with a message. Nothing panics or aborts, and unless
//! the device is lost, it draws the same picture afterwards.

mod results;
mod scenarios;

use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use gaurast_runner::Case;
use results::{LOST, RESULTS};
use scenarios::{Opened, Scenario, Use};
use simdevice::host::injection;

/// The messages of panics in any thread since the last check.
static PANICS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// The number of allocations of a scenario that are failed one by one; later ones are sampled ever more sparsely.
const EACH: u64 = 40;

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Counts of a scenario's runs by their end: each of [`RESULTS`], or the correct picture.
#[derive(Debug, Default)]
struct Ended {
    failed: [u32; RESULTS.len()],
    succeeded: u32,
}

/// Uses a device. Returns the picture, or the index in [`RESULTS`] of the error.
fn attempt(used: &Use) -> Result<Vec<u8>, usize> {
    // The scenario is an application that panics at the first error. Nothing else in this process does.
    let outcome = catch_unwind(AssertUnwindSafe(used));
    let panics = std::mem::take(&mut *lock(&PANICS));
    match outcome {
        Ok(picture) => {
            assert!(panics.is_empty(), "{panics:?}");
            Ok(picture)
        }
        Err(_) => {
            assert_eq!(panics.len(), 1, "{panics:?}");
            let result = RESULTS.iter().position(|name| panics[0].contains(name));
            Err(result.unwrap_or_else(|| panic!("not for want of memory: {panics:?}")))
        }
    }
}

/// Fails a scenario's allocations, one in each run.
fn fail_each(scenario: &Scenario) -> Ended {
    let expected = attempt(&(scenario.open)()).expect("there is memory");
    let (mut n, mut ended) = (0, Ended::default());
    loop {
        let used = (scenario.open)();
        injection::fail(n);
        let outcome = attempt(&used);
        if injection::stop().is_some() {
            break;
        }
        match outcome {
            Err(LOST) => {
                ended.failed[LOST] += 1;
                let again = attempt(&used);
                let as_it_should = match scenario.device {
                    Opened::Before => again == Err(LOST),
                    Opened::Within => again.as_ref() == Ok(&expected),
                };
                assert!(as_it_should, "{}, {n}", scenario.name);
            }
            // The driver works without memory that only serves speed.
            Ok(picture) => {
                ended.succeeded += 1;
                assert!(picture == expected, "{}, {n}", scenario.name);
            }
            Err(result) => {
                ended.failed[result] += 1;
                let again = attempt(&used);
                assert!(again.as_ref() == Ok(&expected), "{}, {n}", scenario.name);
            }
        }
        n += if n < EACH { 1 } else { 1 + n / 8 };
    }
    ended
}

#[gaurast_runner::test(each = scenarios::variants(), alone)]
fn every_allocation_may_fail(case: &Case) {
    std::panic::set_hook(Box::new(|info| {
        let message = info.to_string();
        if !RESULTS.iter().any(|name| message.contains(name)) {
            eprintln!("{message}");
        }
        lock(&PANICS).push(message);
    }));
    let mut scenarios = scenarios::all().into_iter();
    let scenario = scenarios.find(|scenario| scenario.name == case.variant());
    let scenario = scenario.expect("a scenario");
    let ended = fail_each(&scenario);
    let _ = std::panic::take_hook();
    for &result in scenario.results {
        assert!(ended.failed[result] > 0, "no {}: {ended:?}", RESULTS[result]);
    }
}

/// Every result must occur in at least one scenario.
#[gaurast_runner::test]
fn every_result_is_asked_for() {
    let scenarios = scenarios::all();
    assert!(scenarios.iter().all(|scenario| !scenario.results.is_empty()));
    let asked: BTreeSet<_> = scenarios.iter().flat_map(|scenario| scenario.results).collect();
    assert_eq!(asked.len(), RESULTS.len());
}

/// The table of `ALLOCATIONS.md` lists exactly the files that allocate through `devmem::host`.
#[gaurast_runner::test]
fn every_place_is_listed() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let table = std::fs::read_to_string(root.join("simdevice/devmem/ALLOCATIONS.md")).expect("the table");
    let rows = table.lines().filter_map(|line| line.strip_prefix("| `"));
    let listed: BTreeSet<String> = rows.filter_map(|row| Some(row.split_once("` |")?.0.to_owned())).collect();
    let mut found = BTreeSet::from(["simdevice/devmem/src/memory.rs".to_owned()]);
    let mut folders: Vec<_> =
        ["simdevice/src", "simdevice/isa/src", "driver/src"].map(|folder| root.join(folder)).into();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs")
                && allocates(&std::fs::read_to_string(&path).expect("a source file"))
            {
                let name = path.strip_prefix(&root).expect("within");
                found.insert(name.to_string_lossy().into_owned());
            }
        }
    }
    assert_eq!(listed, found);
}

/// Returns true if a source file allocates through `devmem::host`, outside its tests.
fn allocates(text: &str) -> bool {
    const FUNCTIONS: [&str; 10] =
        ["reserve", "extend", "push", "resize", "with_capacity", "filled", "copied", "boxed", "collect", "zeroed"];
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    FUNCTIONS.iter().any(|function| text.contains(&format!("host::{function}")))
}
