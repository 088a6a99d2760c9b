//! A test of the cases themselves: the embedded device makes one deliberate mistake after another, and for each mistake
//! some case must fail.

use std::collections::BTreeMap;
use std::process::ExitCode;

use simdevice::mistakes::{Mistake, make};

use crate::cases::Case;
use crate::implementation::Implementation;
use crate::run::{Outcome, run};

/// Makes the device commit each mistake, and prints the cases that catch it, by chapter. Fails if no case catches a
/// mistake, or if a case fails without a mistake.
pub fn prove(device: &dyn Implementation, cases: &[Case]) -> ExitCode {
    let mut escaped = 0;
    make(None);
    let failing = failing(device, cases);
    let mut caught: BTreeMap<&str, usize> = BTreeMap::new();
    if !failing.is_empty() {
        println!("without a mistake {} cases fail, the first of them {}", failing.len(), failing[0].path());
        return ExitCode::FAILURE;
    }
    for &(mistake, text) in Mistake::ALL {
        make(Some(mistake));
        let failing = self::failing(device, cases);
        make(None);
        let mut chapters: BTreeMap<&str, usize> = BTreeMap::new();
        for case in &failing {
            *chapters.entry(case.chapter).or_default() += 1;
            *caught.entry(case.chapter).or_default() += 1;
        }
        let chapters: Vec<String> = chapters.iter().map(|(chapter, count)| format!("{chapter} {count}")).collect();
        let outcome = match failing.first() {
            Some(first) => format!("{}; first {}", chapters.join(", "), first.path()),
            None => "ESCAPES".to_owned(),
        };
        println!("{mistake:?} ({}): {outcome}", text.trim());
        escaped += usize::from(failing.is_empty());
    }
    println!("{} mistakes, {escaped} of them escape", Mistake::ALL.len());
    if escaped == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn failing<'a>(device: &dyn Implementation, cases: &'a [Case]) -> Vec<&'a Case> {
    let fails = |case: &&Case| matches!(run(case, device), Outcome::Fail(_));
    cases.iter().filter(fails).collect()
}
