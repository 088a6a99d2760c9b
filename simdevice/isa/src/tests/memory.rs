//! Loads, stores, atomics and images: accesses in range and out of range, by all lanes and by some.

use std::sync::{Arc, Mutex};

use crate::builder::Builder;
use crate::clock::host_time;
use crate::compiler::Options;
use crate::ir::{
    Address, AtomicOp, Binding, Dimension, Format, ImageRead, ImageShape, ImageWrite, Program, Rate, Reg, Space,
    Statement, Type,
};
use crate::machine::{Executable, LaneMask, Machine, Watchdog};
use crate::op::Op;
use crate::resources::{GlobalMemory, ImageUnit, LaneWords, NoImages, Resources, SampleRequest, TexelRequest, words};
use devmem::Allocation;
use devmem::BufferRange;

use gaurast_runner::Case;

use super::{level, machine, run};

const LANES: usize = 64;

fn buffer(offset: u64, size: u64, data: &[u32]) -> BufferRange {
    let memory = Allocation::new_zeroed(offset + size + 512).expect("memory");
    memory.write(offset, data).expect("it fits");
    BufferRange { memory, offset, size }
}

fn contents(range: &BufferRange, words: usize) -> Vec<u32> {
    let mut out = vec![0; words];
    range.memory.read(range.offset, &mut out).expect("it fits");
    out
}

fn at(slot: u32, base: Reg, offset: u32) -> Address {
    Address { space: Space::Buffer(Binding::new(slot)), base: Some(base), offset }
}

/// A program that loads elements from an input address into its outputs.
fn loader(format: Format, count: usize, offset: u32) -> Program {
    let mut b = Builder::new();
    let address = b.input(0, Type::B32, Rate::Varying);
    let values = b.load(at(0, address, offset), format, count);
    for (slot, value) in values.into_iter().enumerate() {
        let out = b.output(slot as u32, format.register_type());
        b.assign(out, value);
    }
    b.finish().expect("a valid program")
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn loads_read_what_is_there_and_zero_beyond(case: &Case) {
    let (name, level) = level(case);
    let data: Vec<u32> = (0..300).map(|index: u32| index.wrapping_mul(0x0101_0101)).collect();
    let range = buffer(64, 1000, &data);
    let bytes: Vec<u8> = data.iter().flat_map(|word| word.to_le_bytes()).collect();
    let buffers = [Some(range)];
    let resources = Resources { buffers: &buffers, ..Resources::default() };
    // Consecutive, strided, scattered, out of range, and near overflow.
    let patterns: [fn(usize) -> u32; 6] = [
        |lane| 4 * lane as u32,
        |lane| 12 * lane as u32,
        |lane| (lane * 37 % 61) as u32,
        |lane| 940 + lane as u32,
        |lane| u32::MAX - lane as u32,
        |lane| 8 * lane as u32,
    ];
    for format in [Format::U8, Format::S8, Format::U16, Format::S16, Format::B32, Format::B64] {
        for (count, offset) in [(1, 0), (2, 4), (3, 0), (1, u32::MAX)] {
            let program = loader(format, count, offset);
            let mut machine = machine(&program, level, LANES);
            for pattern in patterns {
                (0..LANES).for_each(|lane| machine.set_input(0, lane, pattern(lane)));
                run(&mut machine, LANES, &resources);
                for lane in 0..LANES {
                    for element in 0..count {
                        let size = u64::from(format.bytes());
                        let start = u64::from(pattern(lane)) + u64::from(offset) + element as u64 * size;
                        let valid = start + size <= 1000 && start.is_multiple_of(size.min(4));
                        let mut raw = [0; 8];
                        if valid {
                            let from = start as usize;
                            raw[..size as usize].copy_from_slice(&bytes[from..from + size as usize]);
                        }
                        let expected = match format {
                            Format::S8 => u64::from(i32::from(raw[0] as i8).cast_unsigned()),
                            Format::S16 => u64::from(i32::from(i16::from_le_bytes([raw[0], raw[1]])).cast_unsigned()),
                            _ => u64::from_le_bytes(raw),
                        };
                        let got = if format == Format::B64 {
                            machine.output64(element as u32, lane)
                        } else {
                            u64::from(machine.output(element as u32, lane))
                        };
                        assert_eq!(got, expected, "{format:?} at {start} in lane {lane} at {name}");
                    }
                }
            }
        }
    }
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn stores_touch_only_their_bytes_and_vanish_beyond(case: &Case) {
    let (name, level) = level(case);
    let mut b = Builder::new();
    let address = b.input(0, Type::B32, Rate::Varying);
    let value = b.input(1, Type::B32, Rate::Varying);
    b.store(at(0, address, 0), Format::U8, &[value]);
    b.store(at(1, address, 0), Format::U16, &[value, value]);
    b.store(at(2, address, 0), Format::B32, &[value]);
    b.store(at(3, address, 0), Format::B32, &[value]);
    let program = b.finish().expect("a valid program");
    let buffers: Vec<Option<BufferRange>> = (0..3).map(|_| Some(buffer(16, 40, &[u32::MAX; 20]))).collect();
    let mut machine = machine(&program, level, LANES);
    for lane in 0..LANES {
        // The last lanes address bytes beyond the range, and beyond all memory.
        let target = if lane < 60 { 4 * lane as u32 } else { u32::MAX - lane as u32 };
        machine.set_input(0, lane, target);
        machine.set_input(1, lane, 0x0100 + lane as u32);
    }
    let resources = Resources { buffers: &buffers, ..Resources::default() };
    run(&mut machine, 3, &resources);
    run(&mut machine, LANES, &resources);
    let [narrow, short, word] = [0, 1, 2].map(|slot| contents(buffers[slot].as_ref().expect("bound"), 12));
    assert_eq!(narrow[..3], [0xffff_ff00, 0xffff_ff01, 0xffff_ff02], "{name}");
    assert_eq!(short[1], 0x0101_0101, "{name}");
    assert_eq!(word[..3], [0x100, 0x101, 0x102], "{name}");
    assert_eq!(word[9], 0x109, "{name}");
    assert_eq!([narrow[10], short[10], word[10]], [u32::MAX; 3], "beyond the range at {name}");
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn helpers_and_inactive_lanes_write_nothing(case: &Case) {
    let (name, level) = level(case);
    let mut b = Builder::new();
    let lane = b.lane_index();
    let (two, one) = (b.u32(2), b.u32(1));
    let address = b.compute(Op::Shl, &[lane, two]);
    b.store(at(0, address, 0), Format::B32, &[one]);
    let zero = b.u32(0);
    let old = b.atomic(AtomicOp::IAdd, at(1, zero, 0), Format::B32, one, None);
    let helper = b.is_helper();
    let out = b.output(0, Type::Bool);
    b.assign(out, helper);
    let order = b.output(1, Type::B32);
    b.assign(order, old);
    let program = b.finish().expect("a valid program");
    let buffers = [Some(buffer(0, 256, &[])), Some(buffer(0, 4, &[]))];
    let resources = Resources { buffers: &buffers, ..Resources::default() };
    let mut machine = machine(&program, level, LANES);
    let mut helpers = LaneMask::none();
    helpers.set(3, true);
    machine.run(&LaneMask::first(20), &helpers, &resources, Watchdog::default()).expect("it ends");
    let written = contents(buffers[0].as_ref().expect("bound"), LANES);
    for (lane, written) in written.into_iter().enumerate() {
        assert_eq!(written == 1, lane < 20 && lane != 3, "lane {lane} at {name}");
        assert_eq!(machine.output(0, lane) != 0, lane == 3, "lane {lane} at {name}");
    }
    assert_eq!(contents(buffers[1].as_ref().expect("bound"), 1), [19]);
    assert_eq!([machine.output(1, 2), machine.output(1, 4)], [2, 3], "atomics go in order of lanes");
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn atomics_give_the_old_value_and_change_memory(case: &Case) {
    let (_, level) = level(case);
    let ops = [
        (AtomicOp::IAdd, 5u32, 7u32, 12u32),
        (AtomicOp::SMin, 5, 0xffff_fff0, 0xffff_fff0),
        (AtomicOp::SMax, 5, 0xffff_fff0, 5),
        (AtomicOp::UMin, 5, 0xffff_fff0, 5),
        (AtomicOp::UMax, 5, 0xffff_fff0, 0xffff_fff0),
        (AtomicOp::And, 0b1100, 0b1010, 0b1000),
        (AtomicOp::Or, 0b1100, 0b1010, 0b1110),
        (AtomicOp::Xor, 0b1100, 0b1010, 0b0110),
        (AtomicOp::Exchange, 5, 9, 9),
        (AtomicOp::FAdd, 0x3f80_0000, 0x4000_0000, 0x4040_0000),
        (AtomicOp::FMin, 0x3f80_0000, 0x4000_0000, 0x3f80_0000),
        (AtomicOp::FMax, 0x3f80_0000, 0x4000_0000, 0x4000_0000),
    ];
    for (op, before, operand, after) in ops {
        for space in [Space::Buffer(Binding::new(0)), Space::Shared] {
            let mut b = Builder::new();
            b.allocate_shared(16, 4);
            let (first, value) = (b.u32(before), b.u32(operand));
            let address = Address { space, base: None, offset: 4 };
            b.store(address, Format::B32, &[first]);
            let old = b.atomic(op, address, Format::B32, value, None);
            let new = b.load(address, Format::B32, 1)[0];
            for (slot, value) in [old, new].into_iter().enumerate() {
                let out = b.output(slot as u32, Type::B32);
                b.assign(out, value);
            }
            let program = b.finish().expect("a valid program");
            let buffers = [Some(buffer(0, 16, &[]))];
            let mut machine = machine(&program, level, 16);
            run(&mut machine, 1, &Resources { buffers: &buffers, ..Resources::default() });
            assert_eq!([machine.output(0, 0), machine.output(1, 0)], [before, after], "{op:?}");
        }
    }
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn wide_atomics_and_compare_exchange(case: &Case) {
    let (_, level) = level(case);
    let mut b = Builder::new();
    let lane = b.lane_index();
    let wide = b.compute(Op::UToU64, &[lane]);
    let big = b.u64(1 << 40);
    let value = b.compute(Op::IAdd64, &[wide, big]);
    let address = Address { space: Space::Buffer(Binding::new(0)), base: None, offset: 8 };
    let old = b.atomic(AtomicOp::IAdd, address, Format::B64, value, None);
    let out = b.output(0, Type::B64);
    b.assign(out, old);
    let (one, zero) = (b.u32(1), b.u32(0));
    let lock = Address { space: Space::Buffer(Binding::new(0)), base: None, offset: 0 };
    let seen = b.atomic(AtomicOp::CompareExchange, lock, Format::B32, one, Some(zero));
    let out = b.output(1, Type::B32);
    b.assign(out, seen);
    let program = b.finish().expect("a valid program");
    let buffers = [Some(buffer(0, 16, &[]))];
    let mut machine = machine(&program, level, 16);
    run(&mut machine, 4, &Resources { buffers: &buffers, ..Resources::default() });
    assert_eq!(machine.output64(0, 3), 3 * (1 << 40) + 3);
    assert_eq!([0, 1, 2].map(|lane| machine.output(1, lane)), [0, 1, 1]);
    assert_eq!(contents(buffers[0].as_ref().expect("bound"), 4), [1, 0, 6, 4 << 8]);
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn workgroup_memory_is_shared_between_lanes_and_starts_as_zero(case: &Case) {
    let (_, level) = level(case);
    let mut b = Builder::new();
    let base = b.allocate_shared(4 * LANES as u32, 4);
    let lane = b.lane_index();
    let (two, last) = (b.u32(2), b.u32(LANES as u32 - 1));
    let own = b.compute(Op::Shl, &[lane, two]);
    let mirror = b.compute(Op::ISub, &[last, lane]);
    let other = b.compute(Op::Shl, &[mirror, two]);
    let shared = |at| Address { space: Space::Shared, base: Some(at), offset: base };
    let before = b.load(shared(own), Format::B32, 1)[0];
    b.store(shared(own), Format::B32, &[lane]);
    b.barrier();
    let after = b.load(shared(other), Format::B32, 1)[0];
    let sum = b.compute(Op::IAdd, &[before, after]);
    let out = b.output(0, Type::B32);
    b.assign(out, sum);
    let program = b.finish().expect("a valid program");
    let mut machine = machine(&program, level, LANES);
    for _ in 0..2 {
        run(&mut machine, LANES, &Resources::default());
        (0..LANES).for_each(|lane| assert_eq!(machine.output(0, lane) as usize, LANES - 1 - lane));
    }
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn workgroups_that_share_a_batch_have_memory_of_their_own(case: &Case) {
    const GROUP: usize = 32;
    let (_, level) = level(case);
    let mut b = Builder::new();
    let base = b.allocate_shared(4 * (GROUP as u32 + 1), 4);
    let (value, index) = (b.input(0, Type::B32, Rate::Varying), b.lane_index());
    let (two, zero, count) = (b.u32(2), b.u32(0), b.u32(4 * GROUP as u32));
    let own = b.compute(Op::Shl, &[index, two]);
    let shared = |at| Address { space: Space::Shared, base: Some(at), offset: base };
    let beyond = Address { space: Space::Shared, base: Some(count), offset: base + 4 };
    let before = b.load(shared(own), Format::B32, 1)[0];
    b.store(shared(own), Format::B32, &[value]);
    b.store(beyond, Format::B32, &[value]);
    b.barrier();
    let of_first = b.load(shared(zero), Format::B32, 1)[0];
    let of_none = b.load(beyond, Format::B32, 1)[0];
    let old = b.atomic(AtomicOp::IAdd, shared(count), Format::B32, value, None);
    let sum = b.load(shared(count), Format::B32, 1)[0];
    for (slot, found) in [before, of_first, of_none, old, sum].into_iter().enumerate() {
        let out = b.output(slot as u32, Type::B32);
        b.assign(out, found);
    }
    let program = b.finish().expect("a valid program");
    let options = Options { lanes: LANES, workgroup: Some(GROUP), subgroup_size: 16, ..Options::new(level) };
    let mut machine = Machine::new(Arc::new(Executable::new(program, &options).expect("a valid program")));
    let value = |lane: usize| 100 + lane as u32;
    (0..LANES).for_each(|lane| machine.set_input(0, lane, value(lane)));
    for active in [LANES, LANES - 5, GROUP + 1, GROUP, 3] {
        run(&mut machine, active, &Resources::default());
        for lane in 0..active {
            let group = lane / GROUP * GROUP..(lane / GROUP * GROUP + GROUP).min(active);
            let found = [0, 1, 2, 3, 4].map(|slot| machine.output(slot, lane));
            let (earlier, all) = (group.start..lane, group.clone());
            let expected = [0, value(group.start), 0, earlier.map(value).sum::<u32>(), all.map(value).sum::<u32>()];
            assert_eq!(found, expected, "lane {lane} of {active}");
        }
    }
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn push_constants_and_descriptor_arrays(case: &Case) {
    let (_, level) = level(case);
    let mut b = Builder::new();
    let index = b.input(0, Type::B32, Rate::Varying);
    let array = Binding { slot: 1, count: 3, index: Some(index) };
    let zero = b.u32(0);
    let value = b.load(Address { space: Space::Buffer(array), base: Some(zero), offset: 0 }, Format::B32, 1)[0];
    let size = b.buffer_size(array);
    let pushed = b.load(Address { space: Space::PushConstants, base: None, offset: 4 }, Format::B32, 2);
    for (slot, value) in [value, size, pushed[0], pushed[1]].into_iter().enumerate() {
        let out = b.output(slot as u32, Type::B32);
        b.assign(out, value);
    }
    let program = b.finish().expect("a valid program");
    let buffers = [None, Some(buffer(0, 4, &[10])), Some(buffer(0, 8, &[20])), None, Some(buffer(0, 12, &[40]))];
    let push = words(&[1, 0, 0, 0, 2, 0, 0, 0, 3]);
    let resources = Resources { buffers: &buffers, push_constants: &push, ..Resources::default() };
    let mut machine = machine(&program, level, 16);
    (0..16).for_each(|lane| machine.set_input(0, lane, lane as u32));
    run(&mut machine, 16, &resources);
    // Bind point 3 is empty; those beyond the array are not used.
    assert_eq!([0, 1, 2, 3, 15].map(|lane| machine.output(0, lane)), [10, 20, 0, 0, 0]);
    assert_eq!([0, 1, 2, 3, 15].map(|lane| machine.output(1, lane)), [4, 8, 0, 0, 0]);
    assert_eq!([machine.output(2, 5), machine.output(3, 5)], [2, 3]);
}

struct OneRange(BufferRange);

impl GlobalMemory for OneRange {
    fn find(&self, address: u64) -> Option<(&BufferRange, u64)> {
        let start = 1 << 40;
        (start..start + self.0.size).contains(&address).then_some((&self.0, start))
    }
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn device_addresses_reach_their_buffer_and_nothing_else(case: &Case) {
    let (_, level) = level(case);
    let mut b = Builder::new();
    let address = b.input(0, Type::B64, Rate::Varying);
    let global = Address { space: Space::Global, base: Some(address), offset: 4 };
    let value = b.load(global, Format::B32, 1)[0];
    let out = b.output(0, Type::B32);
    b.assign(out, value);
    b.store(global, Format::B32, &[value]);
    let program = b.finish().expect("a valid program");
    let memory = OneRange(buffer(0, 16, &[1, 2, 3, 4]));
    let mut machine = machine(&program, level, 16);
    let addresses = [1 << 40, (1 << 40) + 8, (1 << 40) + 12, 0, u64::MAX];
    addresses.iter().enumerate().for_each(|(lane, address)| machine.set_input64(0, lane, *address));
    run(&mut machine, 5, &Resources { global: &memory, ..Resources::default() });
    assert_eq!([0, 1, 2, 3, 4].map(|lane| machine.output(0, lane)), [2, 4, 0, 0, 0]);
}

/// An image unit that records which lanes wrote which image, and returns the coordinates from reads.
struct Recorder(Mutex<Vec<(u32, u16)>>);

impl ImageUnit for Recorder {
    fn sample(&self, image: u32, sampler: u32, request: &SampleRequest, texel: &mut [LaneWords; 4]) {
        NoImages.sample(image, sampler, request, texel);
    }

    fn read(&self, image: u32, request: &TexelRequest, texel: &mut [LaneWords; 4]) {
        *texel = [request.coordinate[0], request.coordinate[1], [image; 16], [u32::from(request.mask); 16]];
    }

    fn write(&self, image: u32, request: &TexelRequest, _texel: &[LaneWords; 4]) {
        self.0.lock().expect("not poisoned").push((image, request.mask));
    }

    fn atomic(
        &self,
        image: u32,
        request: &TexelRequest,
        op: AtomicOp,
        value: &LaneWords,
        comparator: &LaneWords,
    ) -> LaneWords {
        NoImages.atomic(image, request, op, value, comparator)
    }

    fn size(&self, image: u32, shape: ImageShape, level: u32) -> [u32; 4] {
        NoImages.size(image, shape, level)
    }

    fn levels(&self, image: u32) -> u32 {
        NoImages.levels(image)
    }

    fn samples(&self, image: u32) -> u32 {
        NoImages.samples(image)
    }

    fn lod(&self, image: u32, sampler: u32, request: &SampleRequest) -> [LaneWords; 2] {
        NoImages.lod(image, sampler, request)
    }
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn image_instructions_ask_once_for_each_image(case: &Case) {
    let (_, level) = level(case);
    let mut b = Builder::new();
    let index = b.input(0, Type::B32, Rate::Varying);
    let lane = b.lane_index();
    let shape = ImageShape { dimension: Dimension::D2, arrayed: false, multisampled: false };
    let image = Binding { slot: 7, count: 2, index: Some(index) };
    let dst: [Reg; 4] = std::array::from_fn(|_| b.value(Type::B32));
    b.statement(Statement::ImageRead(Box::new(ImageRead {
        dst: dst.map(Some),
        image,
        shape,
        coordinate: vec![lane, index],
        level: None,
        sample: None,
    })));
    let write = ImageWrite { image, shape, coordinate: vec![lane, index], sample: None, texel: dst };
    b.statement(Statement::ImageWrite(Box::new(write)));
    for (slot, value) in dst.into_iter().enumerate() {
        let out = b.output(slot as u32, Type::B32);
        b.assign(out, value);
    }
    let program = b.finish().expect("a valid program");
    let recorder = Arc::new(Recorder(Mutex::new(Vec::new())));
    let mut machine = machine(&program, level, 16);
    (0..16).for_each(|lane| machine.set_input(0, lane, u32::from(lane % 4 == 3)));
    run(&mut machine, 10, &Resources { images: &*recorder, ..Resources::default() });
    assert_eq!(*recorder.0.lock().expect("not poisoned"), [(7, 0b11_0111_0111), (8, 0b00_1000_1000)]);
    assert_eq!([0, 1, 2, 3].map(|slot| machine.output(slot, 7)), [7, 1, 8, 0b1000_1000]);
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn clocks_are_read_where_they_stand(case: &Case) {
    let (name, level) = level(case);
    let mut b = Builder::new();
    let times: Vec<_> = (0..2).map(|slot| b.output(slot, Type::B64)).collect();
    let first = b.clock();
    b.assign(times[0], first);
    let second = b.clock();
    b.assign(times[1], second);
    let lane = b.lane_index();
    let three = b.u32(3);
    let is_low = b.compute(Op::ULt, &[lane, three]);
    b.begin_if(is_low);
    let third = b.clock();
    b.assign(times[1], third);
    b.end();
    let program = b.finish().expect("a valid program");
    let mut machine = machine(&program, level, LANES);
    let before = host_time();
    machine
        .run(&LaneMask::first(LANES), &LaneMask::none(), &Resources::default(), Watchdog::default())
        .expect("it ends");
    let after = host_time();
    let [first, second, third] = [(0, 5), (1, 5), (1, 2)].map(|(slot, lane)| machine.output64(slot, lane));
    let times = [before, first, second, third, after];
    assert!(times.is_sorted(), "{times:?} at {name}");
    assert!(before < after);
    for lane in 0..LANES {
        assert_eq!(machine.output64(0, lane), first, "lane {lane} at {name}");
    }
}
