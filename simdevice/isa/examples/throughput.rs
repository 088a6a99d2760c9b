//! Measures the shader cores' speed: an arithmetic loop and a divergent one, at every SIMD level of this processor.
//!
//! `cargo run --release -p gaurast-isa --example throughput`

use std::sync::Arc;
use std::time::{Duration, Instant};

use isa::Options;
use isa::builder::Builder;
use isa::ir::{Program, Rate, Type};
use isa::level::SimdLevel;
use isa::machine::{Executable, LaneMask, Machine, Watchdog};
use isa::op::Op;
use isa::resources::Resources;

/// A program of 100 iterations of sixteen fused multiply-adds in four chains.
fn arithmetic() -> Program {
    let mut b = Builder::new();
    let x = b.input(0, Type::B32, Rate::Varying);
    let y = b.input(1, Type::B32, Rate::Varying);
    let out = b.output(0, Type::B32);
    let (zero, one, rounds, factor) = (b.u32(0), b.u32(1), b.u32(100), b.f32(0.999));
    let i = b.variable(Type::B32);
    let sums: [_; 4] = std::array::from_fn(|_| b.variable(Type::B32));
    b.assign(i, zero);
    sums.iter().for_each(|sum| b.assign(*sum, x));
    let label = b.begin_loop();
    let done = b.compute(Op::ULe, &[rounds, i]);
    b.begin_if(done);
    b.break_to(label);
    b.end();
    for sum in sums {
        let mut value = sum;
        for _ in 0..4 {
            value = b.compute(Op::FFma, &[value, factor, y]);
        }
        b.assign(sum, value);
    }
    b.begin_continuing();
    let next = b.compute(Op::IAdd, &[i, one]);
    b.assign(i, next);
    b.end();
    let total = sums.into_iter().reduce(|a, c| b.compute(Op::FAdd, &[a, c])).unwrap_or(x);
    b.assign(out, total);
    b.finish().expect("a valid program")
}

/// A program that counts the iterations until a point escapes the Mandelbrot iteration, at most 256.
fn mandelbrot() -> Program {
    let mut b = Builder::new();
    let cx = b.input(0, Type::B32, Rate::Varying);
    let cy = b.input(1, Type::B32, Rate::Varying);
    let out = b.output(0, Type::B32);
    let (zero, one, limit, four) = (b.u32(0), b.u32(1), b.u32(256), b.f32(4.0));
    let [i, x, y] = std::array::from_fn(|_| b.variable(Type::B32));
    b.assign(i, zero);
    b.assign(x, zero);
    b.assign(y, zero);
    let label = b.begin_loop();
    let more = b.compute(Op::ULt, &[i, limit]);
    b.begin_if(more);
    b.begin_else();
    b.break_to(label);
    b.end();
    let xx = b.compute(Op::FMul, &[x, x]);
    let yy = b.compute(Op::FMul, &[y, y]);
    let length = b.compute(Op::FAdd, &[xx, yy]);
    let inside = b.compute(Op::FLe, &[length, four]);
    b.begin_if(inside);
    b.begin_else();
    b.break_to(label);
    b.end();
    let difference = b.compute(Op::FSub, &[xx, yy]);
    let next_x = b.compute(Op::FAdd, &[difference, cx]);
    let double = b.compute(Op::FAdd, &[x, x]);
    let next_y = b.compute(Op::FFma, &[double, y, cy]);
    b.begin_continuing();
    let next = b.compute(Op::IAdd, &[i, one]);
    b.assign(x, next_x);
    b.assign(y, next_y);
    b.assign(i, next);
    b.end();
    b.assign(out, i);
    b.finish().expect("a valid program")
}

/// Runs batches for a while. Returns lanes a second and the work of one pass.
fn measure(program: &Program, level: SimdLevel, lanes: usize) -> Option<(f64, f64, f64)> {
    let options = Options { lanes, count_work: false, ..Options::new(level.resolve()?) };
    let counting = Options { count_work: true, ..options };
    let resources = Resources::default();
    let run = |machine: &mut Machine, start: usize| {
        for lane in 0..lanes {
            let pixel = start + lane;
            machine.set_input(0, lane, ((pixel % 512) as f32 / 200.0 - 2.0).to_bits());
            machine.set_input(1, lane, ((pixel / 512 % 512) as f32 / 256.0 - 1.0).to_bits());
        }
        machine.run(&LaneMask::first(lanes), &LaneMask::none(), &resources, Watchdog::default()).expect("it ends");
    };
    let mut machine = Machine::new(Arc::new(Executable::new(program.clone(), &counting).expect("a valid program")));
    (0..512 * 512).step_by(lanes).for_each(|start| run(&mut machine, start));
    let work = machine.take_work();
    let instructions = work.lanes as f64 / (512.0 * 512.0);
    let mut machine = Machine::new(Arc::new(Executable::new(program.clone(), &options).expect("a valid program")));
    let (begin, mut done) = (Instant::now(), 0u32);
    while begin.elapsed() < Duration::from_millis(800) {
        (0..512 * 512).step_by(lanes).for_each(|start| run(&mut machine, start));
        done += 512 * 512;
    }
    Some((f64::from(done) / begin.elapsed().as_secs_f64(), instructions, work.occupancy()))
}

fn main() {
    // The lines to print: those that contain one of these words; all, if none is given.
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    for (name, program) in [("arithmetic", arithmetic()), ("mandelbrot", mandelbrot())] {
        for (level_name, level) in SimdLevel::supported() {
            for lanes in [64, 256] {
                let words = format!("{name} {level_name} {lanes}");
                if !wanted.iter().all(|word| words.contains(word)) {
                    continue;
                }
                if let Some((rate, instructions, occupancy)) = measure(&program, level, lanes) {
                    println!(
                        "{name:12} {level_name:8} {lanes:4} lanes: {:8.2} M lanes/s, {:6.2} G lane-instructions/s, occupancy {occupancy:.2}",
                        rate / 1e6,
                        rate * instructions / 1e9,
                    );
                }
            }
        }
    }
}
