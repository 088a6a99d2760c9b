//! Dispatches: kernels read bindings, constants, workgroup numbers, and the results of other workgroups.

use ash::vk;
use gaurast_testkit::descriptors::write;
use gaurast_testkit::devices::open;
use gaurast_testkit::shader::spirv;
use gaurast_testkit::{Buffer, Compute, whole};

const STORAGE: vk::DescriptorType = vk::DescriptorType::STORAGE_BUFFER;
const UNIFORM: vk::DescriptorType = vk::DescriptorType::UNIFORM_BUFFER;

#[gaurast_runner::test]
fn push_constants_reach_the_kernel_piece_by_piece() {
    let gpu = open();
    let bindings: &[_] = &[(0, STORAGE, 1), (1, STORAGE, 1)];
    let kernel = Compute::new(&gpu, &spirv("push_constants.comp"), &[bindings]);
    let source: Vec<u32> = (0..256).map(|i| i * i).collect();
    let buffers = [Buffer::of(&gpu, &source), Buffer::new(&gpu, 1024)];
    let set = kernel.storage_set(&[&buffers[0], &buffers[1]]);
    kernel.run(&[set], &[3, 1000], [4, 1, 1]);
    let expected: Vec<_> = source.iter().map(|v| v * 3 + 1000).collect();
    assert_eq!(buffers[1].values::<u32>(), expected);

    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        kernel.bind(commands, &[set]);
        kernel.push(commands, &[7, 1]);
        let stage = vk::ShaderStageFlags::COMPUTE;
        // SAFETY: see the crate.
        unsafe {
            device.cmd_push_constants(commands, kernel.layout, stage, 4, &9u32.to_le_bytes());
            device.cmd_dispatch(commands, 4, 1, 1);
        }
    });
    let expected: Vec<_> = source.iter().map(|v| v * 7 + 9).collect();
    assert_eq!(buffers[1].values::<u32>(), expected);
}

#[gaurast_runner::test]
fn arrays_of_descriptors_are_indexed_at_run_time() {
    let gpu = open();
    let sets: &[&[_]] = &[&[(0, STORAGE, 4)], &[(0, UNIFORM, 2), (3, STORAGE, 1)]];
    let kernel = Compute::new(&gpu, &spirv("descriptors.comp"), sets);
    let sources: Vec<_> =
        (0..4u32).map(|which| Buffer::of(&gpu, &(0..64).map(|i| 1000 * which + i).collect::<Vec<_>>())).collect();
    let numbers = Buffer::of(&gpu, &[10u32, 0, 0, 0, 0, 0, 0, 20]);
    let target = Buffer::new(&gpu, 256);
    let sets = kernel.sets.allocate();
    let infos: Vec<_> = sources.iter().map(whole).collect();
    write(&gpu, sets[0], (0, 0), STORAGE, &infos[..3]);
    write(&gpu, sets[0], (0, 3), STORAGE, &infos[3..]);
    let halves = [0, 16].map(|offset| whole(&numbers).offset(offset).range(16));
    write(&gpu, sets[1], (0, 0), UNIFORM, &halves);
    write(&gpu, sets[1], (3, 0), STORAGE, &[whole(&target)]);
    kernel.run(&sets, &[], [4, 1, 1]);
    let expected: Vec<u32> = (0..64).map(|i| 1000 * (i / 4 % 4) + i + 30).collect();
    assert_eq!(target.values::<u32>(), expected);
}

#[gaurast_runner::test]
fn dynamic_offsets_go_to_their_descriptors_in_order() {
    let gpu = open();
    let dynamic = vk::DescriptorType::STORAGE_BUFFER_DYNAMIC;
    let bindings: &[_] = &[(0, dynamic, 1), (1, dynamic, 1)];
    let kernel = Compute::new(&gpu, &spirv("push_constants.comp"), &[bindings]);
    let source = Buffer::of(&gpu, &(0..256u32).collect::<Vec<_>>());
    let target = Buffer::of(&gpu, &[0u32; 256]);
    let set = kernel.sets.allocate()[0];
    write(&gpu, set, (0, 0), dynamic, &[whole(&source).range(256)]);
    write(&gpu, set, (1, 0), dynamic, &[whole(&target).offset(16).range(256)]);
    let bind_point = vk::PipelineBindPoint::COMPUTE;
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        kernel.bind(commands, &[]);
        kernel.push(commands, &[1, 0]);
        // SAFETY: see the crate.
        unsafe {
            let offsets = [128 * 4, 32 * 4];
            device.cmd_bind_descriptor_sets(commands, bind_point, kernel.layout, 0, &[set], &offsets);
            device.cmd_dispatch(commands, 1, 1, 1);
        }
    });
    let written = target.values::<u32>();
    let expected: Vec<u32> = (128..192).collect();
    assert_eq!(written[36..100], expected);
    assert!(written[..36].iter().chain(&written[100..]).all(|&v| v == 0));

    let too_few = gpu.try_record(|recording| {
        let (device, commands) = recording.raw();
        // SAFETY: this is invalid usage, which the driver must survive.
        unsafe {
            device.cmd_bind_descriptor_sets(commands, bind_point, kernel.layout, 0, &[set], &[0]);
        }
    });
    assert!(too_few.is_err());
}

#[gaurast_runner::test]
fn specialization_constants_change_the_kernel() {
    let gpu = open();
    let bindings: &[_] = &[(0, STORAGE, 1)];
    let entry = |id, offset| vk::SpecializationMapEntry::default().constant_id(id).offset(offset).size(4);
    let run = |entries: &[vk::SpecializationMapEntry], data: &[u8]| {
        let info = vk::SpecializationInfo::default().map_entries(entries).data(data);
        let words = spirv("specialization.comp");
        let kernel = Compute::specialized(&gpu, &words, &[bindings], &info);
        let target = Buffer::of(&gpu, &[0f32; 64]);
        kernel.run(&[kernel.storage_set(&[&target])], &[], [1, 1, 1]);
        target.values::<f32>()
    };
    let values = run(&[], &[]);
    assert_eq!((values[0], values[1], values[63]), (5.0, 0.0, 1.0));
    let data: Vec<u8> = [8u32, 3, 2.5f32.to_bits(), 1].iter().flat_map(|word| word.to_le_bytes()).collect();
    let values = run(&[entry(0, 0), entry(1, 4), entry(2, 8), entry(3, 12)], &data);
    let expected: Vec<_> = (0..8).map(|i| -((i + 3) as f32) * 2.5).collect();
    assert_eq!(values[..8], expected);
    assert_eq!((values[8], values[63]), (0.0, 8.0));
}

/// Checks the notes that `groups.comp` wrote, and returns their workgroup numbers, sorted.
fn noted(target: &Buffer, count: [u32; 3]) -> Vec<[u32; 3]> {
    let words = target.values::<u32>();
    let notes: Vec<_> = words[4..].chunks_exact(4).take(words[0] as usize).collect();
    let packed = count[0] | count[1] << 8 | count[2] << 16;
    assert!(notes.iter().all(|note| note[1] == packed && note[3] == 0));
    let mut locals: Vec<_> = notes.iter().map(|note| note[2]).collect();
    locals.sort_unstable();
    let groups = notes.len() / 12;
    assert!(locals.iter().enumerate().all(|(i, &local)| local as usize == i / groups));
    let mut ids: Vec<_> = notes
        .iter()
        .filter(|note| note[2] == 0)
        .map(|note| [note[0] & 255, note[0] >> 8 & 255, note[0] >> 16])
        .collect();
    ids.sort_unstable();
    ids
}

#[gaurast_runner::test]
fn every_workgroup_runs_once_and_knows_its_place() {
    let gpu = open();
    let kernel = Compute::new(&gpu, &spirv("groups.comp"), &[&[(0, STORAGE, 1)]]);
    let target = Buffer::of(&gpu, &[0u32; 4 + 4 * 12 * 64]);
    let set = kernel.storage_set(&[&target]);
    let all = |base: [u32; 3], count: [u32; 3]| {
        let mut ids = Vec::new();
        for x in 0..count[0] {
            for y in 0..count[1] {
                ids.extend((0..count[2]).map(|z| [base[0] + x, base[1] + y, base[2] + z]));
            }
        }
        ids
    };
    kernel.run(&[set], &[], [4, 3, 5]);
    assert_eq!(noted(&target, [4, 3, 5]), all([0; 3], [4, 3, 5]));

    target.write(&[0u8; 4]);
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        kernel.bind(commands, &[set]);
        // SAFETY: see the crate.
        unsafe { device.cmd_dispatch_base(commands, 7, 200, 1, 2, 1, 3) };
    });
    assert_eq!(noted(&target, [2, 1, 3]), all([7, 200, 1], [2, 1, 3]));

    target.write(&[0u8; 4]);
    let parameters = Buffer::of(&gpu, &[0u32, 3, 2, 1]);
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        kernel.bind(commands, &[set]);
        // SAFETY: see the crate.
        unsafe {
            device.cmd_dispatch_indirect(commands, parameters.raw, 4);
            // The parameters are zero: no workgroup runs.
            device.cmd_dispatch_indirect(commands, parameters.raw, 0);
            device.cmd_dispatch(commands, 0, 1, 1);
        }
    });
    assert_eq!(noted(&target, [3, 2, 1]), all([0; 3], [3, 2, 1]));
}

#[gaurast_runner::test]
fn shared_memory_is_ordered_by_barriers() {
    let gpu = open();
    let kernel = Compute::new(&gpu, &spirv("shared.comp"), &[&[(0, STORAGE, 1)]]);
    let values: Vec<u32> = (0..256 * 33).map(|i| i % 251 + 1).collect();
    let data = Buffer::of(&gpu, &values);
    kernel.run(&[kernel.storage_set(&[&data])], &[], [33, 1, 1]);
    let expected: Vec<u32> = values
        .chunks_exact(256)
        .flat_map(|chunk| {
            chunk.iter().scan(0, |sum, &value| {
                *sum += value;
                Some(*sum)
            })
        })
        .collect();
    assert_eq!(data.values::<u32>(), expected);
}

#[gaurast_runner::test]
fn atomics_lose_nothing() {
    let gpu = open();
    let kernel = Compute::new(&gpu, &spirv("atomic_words.comp"), &[&[(0, STORAGE, 1)]]);
    let data = Buffer::of(&gpu, &[0u32, 0, u32::MAX, 0, u32::MAX, 0, 0, 0]);
    let groups = 20;
    kernel.run(&[kernel.storage_set(&[&data])], &[], [groups, 1, 1]);
    let count = groups * 128;
    let values = data.values::<u32>();
    let xored = (0..count).fold(0, |all, i| all ^ i);
    assert_eq!(values[..4], [count * (count - 1) / 2, count - 1, 7, u32::MAX]);
    assert_eq!(values[4..6], [0xffff_0000, xored]);
    assert!((1000..1000 + count).contains(&values[6]));
    assert_eq!(values[7], count);
}

#[gaurast_runner::test]
fn what_is_out_of_range_reads_zero_and_takes_nothing() {
    let gpu = open();
    let bindings: &[_] = &[(0, STORAGE, 1), (1, UNIFORM, 1), (2, STORAGE, 1)];
    let kernel = Compute::new(&gpu, &spirv("robust.comp"), &[bindings]);
    let data = Buffer::of(&gpu, &(100..228u32).collect::<Vec<_>>());
    let target = Buffer::new(&gpu, 32 * 12);
    let set = kernel.sets.allocate()[0];
    // 8 of 128 words are bound, so that a write beyond them would be visible in the rest.
    write(&gpu, set, (0, 0), STORAGE, &[whole(&data).offset(64).range(32)]);
    write(&gpu, set, (2, 0), STORAGE, &[whole(&target)]);
    for stride in [1, 3, 1 << 20, 0x0800_0001] {
        data.write(&(100..228u32).collect::<Vec<_>>());
        kernel.run(&[set], &[stride], [1, 1, 1]);
        let found = target.values::<u32>();
        let kept = data.values::<u32>();
        for i in 0..32u32 {
            let far = i.wrapping_mul(stride);
            let inside = far < 8;
            let read = if inside { 116 + far } else { 0 };
            assert_eq!(found[3 * i as usize], read, "stride {stride}, invocation {i}");
            assert_eq!(found[3 * i as usize + 1], 8);
        }
        let outside = kept[..16].iter().chain(&kept[24..]);
        assert!(outside.eq((100..116).chain(124..228).collect::<Vec<_>>().iter()));
        assert_eq!(kept[16], 0xdead_beef);
    }
}

#[gaurast_runner::test]
fn subgroups_know_each_other() {
    let gpu = open();
    let kernel = Compute::new(&gpu, &spirv("subgroups.comp"), &[&[(0, STORAGE, 1)]]);
    let target = Buffer::new(&gpu, 128 * 16);
    kernel.run(&[kernel.storage_set(&[&target])], &[], [1, 1, 1]);
    let values = target.values::<[u32; 4]>();
    for (i, value) in (0u32..).zip(&values) {
        let subgroup = i / 32;
        let place = 32 | 4 << 8 | subgroup << 16 | (i % 32) << 24;
        let sum: u32 = (32 * subgroup..32 * subgroup + 32).sum();
        assert_eq!(*value, [place, i ^ 1, sum, 16], "invocation {i}");
    }
}
