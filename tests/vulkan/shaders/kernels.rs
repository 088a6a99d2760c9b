//! Realistic kernels give the results that the host computes, on this driver and on lavapipe.

use gaurast_runner::Need;
use gaurast_workloads::kernels::{Context, Size, all};

use super::lavapipe;

fn check(context: &Context) {
    for kernel in all(Size::Small) {
        let place = format!("{} on {}", kernel.name, context.name);
        let prepared = context.prepare(&kernel).unwrap_or_else(|error| panic!("{place}: {error}"));
        prepared.run().unwrap_or_else(|error| panic!("{place}: {error}"));
        for expected in &kernel.expected {
            let found = prepared.read(expected.binding);
            if let Some((index, difference)) = expected.values.difference(&found) {
                panic!("{place}: word {index} of binding {}: {difference}", expected.binding);
            }
        }
    }
}

#[gaurast_runner::test]
fn kernels_give_what_the_host_computes() {
    check(&Context::gaurast().unwrap());
}

#[gaurast_runner::test(needs = [Need::Lavapipe])]
fn kernels_give_the_same_on_lavapipe() {
    check(&lavapipe());
}
