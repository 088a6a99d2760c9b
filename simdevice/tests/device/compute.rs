//! Dispatches through the command processor: every workgroup runs, work is counted, and every dispatch ends.

use simdevice::BufferRange;
use simdevice::command_processor::ExecutionError;
use simdevice::isa::builder::Builder;
use simdevice::isa::ir::{Address, Binding, Format, Label, Program, Rate, Space, Statement, Type};
use simdevice::isa::machine::Stopped;
use simdevice::isa::op::Op;
use simdevice::packet::Dispatch;
use simdevice::program::bindings::Bindings;
use simdevice::program::compute::ComputeProgram;
use simdevice::program::interface::ComputeInput;
use simdevice::stats::counters::Counter;
use simdevice::{Allocation, CommandProcessor, Config, Device, Packet};
use std::sync::Arc;
use std::time::Duration;

fn device() -> Arc<Device> {
    let config = Config { threads: 2, shader_timeout: Duration::from_millis(50), ..Config::default() };
    Arc::new(Device::new(&config).unwrap())
}

/// A program whose invocations each store their workgroup's number times 100 plus their own.
fn numbering(invocations: u32) -> Program {
    let mut b = Builder::new();
    let group = b.input(0, Type::B32, Rate::Uniform);
    let lane = b.lane_index();
    let (hundred, invocations, four) = (b.u32(100), b.u32(invocations), b.u32(4));
    let scaled = b.compute(Op::IMul, &[group, hundred]);
    let value = b.compute(Op::IAdd, &[scaled, lane]);
    let first = b.compute(Op::IMul, &[group, invocations]);
    let index = b.compute(Op::IAdd, &[first, lane]);
    let base = b.compute(Op::IMul, &[index, four]);
    let address = Address { space: Space::Buffer(Binding::new(0)), base: Some(base), offset: 0 };
    b.store(address, Format::B32, &[value]);
    b.finish().unwrap()
}

fn dispatch(program: &Arc<ComputeProgram>, memory: &Arc<Allocation>, count: [u32; 3]) -> Packet {
    let range = BufferRange { memory: Arc::clone(memory), offset: 0, size: memory.len() };
    Packet::Dispatch(Box::new(Dispatch {
        program: Arc::clone(program),
        base: [1, 0, 0],
        count,
        bindings: Bindings { buffers: vec![Some(range)], written: vec![Arc::clone(memory)], ..Bindings::default() },
    }))
}

#[gaurast_runner::test]
fn every_workgroup_runs_and_its_work_is_counted() {
    let device = device();
    let inputs = vec![Some(ComputeInput::WorkgroupId(0))];
    let program = ComputeProgram::new(device.level(), numbering(20), 20, 32, inputs).unwrap();
    let (program, memory) = (Arc::new(program), Allocation::new_zeroed(80 * 400).unwrap());
    let mut processor = CommandProcessor::new(device);
    processor.execute(&dispatch(&program, &memory, [300, 1, 1])).unwrap();
    let mut words = vec![0u32; 20 * 302];
    memory.read(0, &mut words).unwrap();
    for (index, word) in (0u32..).zip(words) {
        let (group, lane) = (index / 20, index % 20);
        let ran = (1..=300).contains(&group);
        assert_eq!(word, if ran { 100 * group + lane } else { 0 });
    }
    assert_eq!(memory.generation(), 1);
    let counters = processor.counters();
    assert_eq!(counters.get(Counter::ShaderBatches), 300);
    assert_eq!(counters.get(Counter::ShaderMemory), 300);
    // 20 of 32 lanes are active.
    let (active, lanes) = (counters.get(Counter::ShaderActiveLanes), counters.get(Counter::ShaderLanes));
    assert!(active > 0);
    assert_eq!(active * 32, lanes * 20);

    processor.execute(&dispatch(&program, &memory, [300, 0, 1])).unwrap();
    assert_eq!(processor.counters().get(Counter::ShaderBatches), 300, "nothing to do");
}

#[gaurast_runner::test]
fn workgroups_that_share_batches_are_numbered_as_others_are() {
    let device = device();
    let program = |invocations, subgroup_size| {
        let inputs = vec![Some(ComputeInput::WorkgroupId(0))];
        let numbering = numbering(invocations);
        ComputeProgram::new(device.level(), numbering, invocations, subgroup_size, inputs).unwrap()
    };
    // Subgroups of 32 do not divide workgroups of 48, and 256 lanes have room for one workgroup of 144.
    for (invocations, subgroup_size, together) in [(64, 32, 4), (96, 32, 2), (48, 32, 1), (48, 16, 5), (144, 16, 1)] {
        for groups in [1, 3, 301] {
            let program = Arc::new(program(invocations, subgroup_size));
            let memory = Allocation::new_zeroed(4 * 400 * u64::from(invocations)).unwrap();
            let mut processor = CommandProcessor::new(Arc::clone(&device));
            processor.execute(&dispatch(&program, &memory, [groups, 1, 1])).unwrap();
            let mut words = vec![0u32; 400 * invocations as usize];
            memory.read(0, &mut words).unwrap();
            for (index, word) in (0u32..).zip(words) {
                let (group, lane) = (index / invocations, index % invocations);
                let ran = (1..=groups).contains(&group);
                assert_eq!(word, if ran { 100 * group + lane } else { 0 }, "{invocations}, {groups}");
            }
            let counters = processor.counters();
            assert_eq!(counters.get(Counter::ComputeInvocations), u64::from(groups * invocations));
            // Both workers get a batch before any batch gets more workgroups.
            let together = groups.div_ceil(2).min(together);
            assert_eq!(counters.get(Counter::ShaderBatches), u64::from(groups.div_ceil(together)));
        }
    }
}

#[gaurast_runner::test]
fn a_program_without_end_is_stopped() {
    let device = device();
    let mut endless = Program::default();
    endless.body.push(Statement::Loop { label: Label(0), body: Vec::new(), continuing: Vec::new() });
    let endless = Arc::new(ComputeProgram::new(device.level(), endless, 16, 32, Vec::new()).unwrap());
    let inputs = vec![Some(ComputeInput::WorkgroupId(0))];
    let honest = ComputeProgram::new(device.level(), numbering(20), 20, 32, inputs).unwrap();
    let memory = Allocation::new_zeroed(80 * 8).unwrap();
    let mut processor = CommandProcessor::new(device);
    let error = processor.execute(&dispatch(&endless, &memory, [7, 5, 3])).unwrap_err();
    let limit = Duration::from_millis(50);
    assert_eq!(error, ExecutionError::Stopped(Stopped::TimedOut { limit }));
    processor.execute(&dispatch(&Arc::new(honest), &memory, [2, 1, 1])).unwrap();
    assert_eq!(memory.load_u32(80 + 4), Some(101));
}
