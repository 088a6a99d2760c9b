//! Tests of fragment shaders on the shader cores, on four quads.

use std::sync::Arc;

use crate::common::translated;
use fearless_simd::Level;
use gaurast_spirv::{BuiltIn, InputSource, OutputTarget, Sampling, Shader, Specialization};
use isa::Options as ExecOptions;
use isa::machine::{Executable, LaneMask, Machine, Watchdog};
use isa::resources::Resources;

const LANES: usize = 16;

/// The pixel of a lane.
fn pixel(lane: usize) -> [f32; 2] {
    [(2 * (lane / 4) + lane % 2) as f32, (lane / 2 % 2) as f32]
}

/// Runs a shader; `input` gives the bits of an input in a lane. Returns the outputs by location, each of four floats.
fn run(shader: &Shader, input: impl Fn(InputSource, usize) -> u32) -> Vec<[[f32; 4]; LANES]> {
    let options = ExecOptions { lanes: LANES, subgroup_size: LANES, ..ExecOptions::new(Level::new()) };
    let executable = Executable::new(shader.program.clone(), &options).unwrap();
    let mut machine = Machine::new(Arc::new(executable));
    for (slot, it) in (0..).zip(&shader.interface.inputs) {
        for lane in 0..LANES {
            machine.set_input(slot, lane, input(it.source, lane));
        }
    }
    let all = LaneMask::first(LANES);
    machine.run(&all, &LaneMask::none(), &Resources::default(), Watchdog::default()).unwrap();
    let mut outputs = Vec::new();
    for (slot, it) in (0..).zip(&shader.interface.outputs) {
        let OutputTarget::Location { location, component, .. } = it.target else {
            panic!("{it:?}");
        };
        outputs.resize(outputs.len().max(location as usize + 1), [[0.0; 4]; LANES]);
        let lanes = outputs[location as usize].iter_mut().enumerate();
        for (lane, output) in lanes {
            output[component as usize] = f32::from_bits(machine.output(slot, lane));
        }
    }
    outputs
}

/// The value of a varying at a point, linear in the framebuffer.
fn varying(location: u32, component: u32, [x, y]: [f32; 2]) -> f32 {
    let (location, component) = (location as f32, component as f32);
    100.0 * location + 10.0 * component + (location + 1.0) * x - (component + 1.0) * y
}

/// The offset added to inputs at the centroid.
const AT_CENTROID: f32 = 5000.0;

/// The element that a lane selects: it differs within quads.
fn chosen(lane: usize) -> usize {
    (5 * lane + 2) % 6
}

fn check_chosen_inputs(shader: &Shader, own: [f32; 2]) {
    let moved = |lane: usize, by: [f32; 2]| [0, 1].map(|axis| pixel(lane)[axis] + by[axis]);
    let offset = |lane: usize| [lane as f32 / 32.0 - 0.25, 0.4 - lane as f32 / 32.0];
    let outputs = run(shader, |source, lane| match source {
        InputSource::Location { location: 7, .. } => chosen(lane) as u32,
        InputSource::Location { location: 8, component, .. } => offset(lane)[component as usize].to_bits(),
        InputSource::Location { location, component, sampling, .. } => {
            let value = varying(location, component, moved(lane, own));
            let more = if sampling == Sampling::Centroid { AT_CENTROID } else { 0.0 };
            (value + more).to_bits()
        }
        InputSource::BuiltIn { built_in: BuiltIn::FragCoord, component } => match component {
            0 | 1 => moved(lane, own)[component as usize].to_bits(),
            _ => 1_f32.to_bits(),
        },
        other => panic!("{other:?}"),
    });
    let output = |location: usize, lane: usize| outputs[location][lane];
    for lane in 0..LANES {
        let element = chosen(lane) as u32;
        let at = |location, component, by: [f32; 2]| {
            let by = [0.5 + by[0], 0.5 + by[1]];
            varying(location, component, moved(lane, by))
        };
        let centroid = |location, component| varying(location, component, moved(lane, own)) + AT_CENTROID;
        let (offset, sample) = (offset(lane), [-6.0 / 16.0, 2.0 / 16.0]);
        let expected = [
            [at(element, 0, offset), at(element, 1, offset), at(element, 1, offset), at(6, 2, offset)],
            [at(element, 0, sample), at(element, 1, sample), centroid(element, 0), centroid(element, 1)],
            [at(6, 3, offset), at(6, 2, offset), centroid(6, 1), centroid(6, 0)],
        ];
        for (location, expected) in expected.iter().enumerate() {
            for (component, expected) in expected.iter().enumerate() {
                let found = output(location, lane)[component];
                assert!(
                    (found - expected).abs() < 2e-3,
                    "output {location}.{component}, lane {lane}: {found}, not {expected}"
                );
            }
        }
    }
}

#[gaurast_runner::test]
fn chosen_inputs_are_interpolated_elsewhere() {
    let shader = translated("chosen_inputs.frag", &Specialization::default());
    check_chosen_inputs(&shader, [0.5, 0.5]);
    // If each sample is shaded, offsets are still relative to the pixel's centre.
    check_chosen_inputs(&shader, [0.875, 0.375]);
}

#[gaurast_runner::test]
fn a_sample_that_is_named_asks_for_a_run_for_each() {
    let shader = translated("never_per_sample.frag", &Specialization::default());
    assert!(shader.interface.inputs.is_empty());
    assert!(shader.interface.per_sample);
    let unread = translated("unread_position.frag", &Specialization::default());
    assert!(unread.interface.per_sample);
    let other = translated("colored.frag", &Specialization::default());
    assert!(!other.interface.per_sample);
}

#[gaurast_runner::test]
fn initialized_outputs_are_written_though_no_code_names_them() {
    let shader = translated("initialized_outputs.frag", &Specialization::default());
    let outputs = run(&shader, |source, _| panic!("{source:?}"));
    let values = outputs.iter().map(|lanes| lanes.map(|output| output[0]));
    assert!(values.eq([[0.5; LANES], [0.25; LANES]]), "{outputs:?}");
}

#[gaurast_runner::test]
fn a_volatile_load_reads_whether_the_invocation_is_a_helper_now() {
    let shader = translated("volatile_helper.frag", &Specialization::default());
    let outputs = run(&shader, |source, lane| match source {
        InputSource::BuiltIn { built_in: BuiltIn::FragCoord, component } => {
            (pixel(lane)[component as usize] + 0.5).to_bits()
        }
        other => panic!("{other:?}"),
    });
    for (lane, found) in outputs[0].iter().enumerate() {
        let demoted = (lane % 2) as f32;
        assert_eq!(*found, [0.0, 0.0, demoted, demoted], "lane {lane}");
    }
}
