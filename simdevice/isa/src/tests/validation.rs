//! Programs that must be refused, and programs that must be stopped.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use fearless_simd::Level;

use crate::builder::Builder;
use crate::compiler::Options;
use crate::ir::{Address, Format, Label, Rate, Reg, Space, Statement, Type};
use crate::machine::{Executable, LaneMask, Machine, Stopped, Watchdog};
use crate::op::Op;
use crate::resources::Resources;

#[gaurast_runner::test]
fn misuse_of_the_builder_is_an_error() {
    let misuses: [fn(&mut Builder); 8] = [
        |b| b.end(),
        |b| b.begin_else(),
        |b| b.begin_continuing(),
        |b| b.begin_case(&[1], false),
        |b| b.fall_through(),
        |b| {
            b.begin_loop();
        },
        |b| {
            (0..100_000).for_each(|_| {
                b.begin_scope();
            });
        },
        |b| b.break_to(Label(7)),
    ];
    for (index, misuse) in misuses.into_iter().enumerate() {
        let mut b = Builder::new();
        misuse(&mut b);
        assert!(b.finish().is_err(), "misuse {index}");
    }
}

#[gaurast_runner::test]
fn wrong_operands_are_errors() {
    let wrongs: [fn(&mut Builder); 12] = [
        |b| {
            b.compute(Op::FAdd, &[Reg(1000), Reg(1001)]);
        },
        |b| {
            let x = b.f32(1.0);
            b.compute(Op::FAdd, &[x]);
        },
        |b| {
            let x = b.bool(true);
            b.compute(Op::FNeg, &[x]);
        },
        |b| {
            let x = b.value(Type::B32);
            b.compute(Op::FNeg, &[x]);
        },
        |b| {
            let (x, y) = (b.f32(1.0), b.f32(2.0));
            b.assign(x, y);
        },
        |b| {
            let (x, y) = (b.variable(Type::B64), b.f32(2.0));
            b.assign(x, y);
        },
        |b| {
            let x = b.f32(1.0);
            b.begin_if(x);
            b.end();
        },
        |b| {
            let x = b.f32(1.0);
            b.store(Address { space: Space::PushConstants, base: None, offset: 0 }, Format::B32, &[x]);
        },
        |b| {
            b.load(Address { space: Space::Global, base: None, offset: 0 }, Format::B32, 1);
        },
        |b| {
            b.load(Address { space: Space::Shared, base: None, offset: 0 }, Format::B32, 17);
        },
        |b| {
            b.input(3, Type::B32, Rate::Varying);
            b.input(3, Type::B32, Rate::Varying);
        },
        |b| {
            let dst = b.variable(Type::B32);
            b.statement(Statement::LaneIndex { dst });
        },
    ];
    for (index, wrong) in wrongs.into_iter().enumerate() {
        let mut b = Builder::new();
        wrong(&mut b);
        let problem = b.finish().expect_err(&format!("wrong program {index}"));
        assert!(!problem.to_string().is_empty());
    }
}

#[gaurast_runner::test]
fn options_out_of_range_are_errors() {
    let program = Builder::new().finish().expect("an empty program is valid");
    for (lanes, subgroup_size) in [(0, 32), (17, 32), (1 << 20, 32), (64, 3), (64, 2), (64, 256)] {
        let options = Options { lanes, subgroup_size, ..Options::new(Level::new()) };
        assert!(Executable::new(program.clone(), &options).is_err(), "{lanes} lanes, subgroups of {subgroup_size}");
    }
}

fn endless() -> Machine {
    let mut b = Builder::new();
    b.begin_loop();
    b.end();
    let program = b.finish().expect("a valid program");
    Machine::new(Arc::new(Executable::new(program, &Options::new(Level::new())).expect("a valid program")))
}

#[gaurast_runner::test]
fn an_endless_loop_is_stopped() {
    let limit = Duration::from_millis(20);
    let watchdog = Watchdog { limit, cancel: None };
    let stopped = endless().run(&LaneMask::first(64), &LaneMask::none(), &Resources::default(), watchdog);
    assert_eq!(stopped, Err(Stopped::TimedOut { limit }));
}

#[gaurast_runner::test]
fn a_cancelled_batch_stops() {
    let cancel = AtomicBool::new(true);
    let watchdog = Watchdog { cancel: Some(&cancel), ..Watchdog::default() };
    let stopped = endless().run(&LaneMask::first(64), &LaneMask::none(), &Resources::default(), watchdog);
    assert_eq!(stopped, Err(Stopped::Cancelled));
}

#[gaurast_runner::test]
fn a_batch_without_lanes_does_nothing() {
    let done = endless().run(&LaneMask::none(), &LaneMask::none(), &Resources::default(), Watchdog::default());
    assert_eq!(done, Ok(()));
}

#[gaurast_runner::test]
fn nothing_is_kept_that_nobody_reads() {
    let mut b = Builder::new();
    let x = b.input(0, Type::B32, Rate::Varying);
    let y = b.input(1, Type::B32, Rate::Varying);
    b.compute(Op::FSin, &[y]);
    let two = b.f32(2.0);
    let four = b.compute(Op::FMul, &[two, two]);
    let eight = b.compute(Op::FMul, &[four, two]);
    let a = b.compute(Op::FMul, &[x, eight]);
    let again = b.compute(Op::FMul, &[x, eight]);
    let sum = b.compute(Op::FAdd, &[a, again]);
    let out = b.output(0, Type::B32);
    b.assign(out, sum);
    let options = Options { count_work: true, ..Options::new(Level::new()) };
    let executable = Executable::new(b.finish().expect("a valid program"), &options).expect("a valid program");
    assert_eq!(executable.inputs().len(), 1, "the second input is not read");
    let mut machine = Machine::new(Arc::new(executable));
    machine.fill_input(0, 3f32.to_bits());
    super::run(&mut machine, 48, &Resources::default());
    assert_eq!(f32::from_bits(machine.output(0, 5)), 48.0);
    let work = machine.take_work();
    assert_eq!(work.instructions.iter().sum::<u64>(), 2, "a product, and a sum that goes to the output");
    assert_eq!(work.occupancy(), 0.75);
}
