//! Tests of checked-in compute shaders on the shader cores, whose results must equal the host's: as compiled, and as
//! optimized by spirv-opt (phis instead of variables, merged and unrolled blocks).

use crate::common::{self, Dispatch, Random, buffer, contents, float_contents, floats};
use gaurast_runner::{Case, Variant};
use gaurast_spirv::{Shader, Specialization};

/// The variant that runs spirv-opt's output.
const OPTIMIZED: &str = "optimized";

/// A variant for each binary of a shader.
fn binaries() -> Vec<Variant> {
    ["compiled", OPTIMIZED].map(Variant::new).into()
}

/// Translates the variant's binary of a shader.
fn translated(case: &Case, name: &str, specialization: &Specialization) -> Shader {
    let suffix = if case.variant() == OPTIMIZED { ".opt" } else { "" };
    common::translated(&format!("{name}{suffix}"), specialization)
}

fn bytes(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

fn close(found: &[f32], expected: &[f32], tolerance: f32) {
    assert_eq!(found.len(), expected.len());
    for (index, (found, expected)) in found.iter().zip(expected).enumerate() {
        let error = (found - expected).abs();
        assert!(error <= tolerance * expected.abs().max(1.0), "element {index}: {found} instead of {expected}");
    }
}

#[gaurast_runner::test(each = binaries())]
fn mandelbrot(case: &Case) {
    let shader = translated(case, "mandelbrot.comp", &Specialization::default());
    let (width, height, limit) = (40_u32, 22_u32, 60_u32);
    let counts = buffer(&vec![u32::MAX; (width * height) as usize]);
    Dispatch {
        buffers: &[((0, 0, 0), &counts)],
        push: &bytes(&[width, height, limit]),
        ..Dispatch::new(&shader, [3, 6, 1])
    }
    .run()
    .unwrap();
    let expected: Vec<u32> = (0..width * height)
        .map(|pixel| {
            let cx = (pixel % width) as f32 / width as f32 * 3.0 - 2.25;
            let cy = (pixel / width) as f32 / height as f32 * 2.0 - 1.0;
            let (mut x, mut y) = (0.0_f32, 0.0_f32);
            for step in 0..limit {
                let (x2, y2) = (x * x, y * y);
                if x2 + y2 > 4.0 {
                    return step;
                }
                (x, y) = (x2 - y2 + cx, 2.0 * x * y + cy);
            }
            limit
        })
        .collect();
    assert_eq!(contents(&counts), expected);
}

#[gaurast_runner::test(each = binaries())]
fn matrix_product_with_a_specialized_tile(case: &Case) {
    for (tile, groups) in [(None, 4), (Some(16_u32), 2)] {
        let mut specialization = Specialization::default();
        if let Some(tile) = tile {
            specialization.set(1, &tile.to_le_bytes());
        }
        let shader = translated(case, "matrix_product.comp", &specialization);
        let n = 32;
        assert_eq!(shader.interface.workgroup_size[0], tile.unwrap_or(8));
        let mut random = Random(7);
        let mut matrix = || -> Vec<f32> { (0..n * n).map(|_| random.unit() - 0.5).collect() };
        let (a, b) = (matrix(), matrix());
        let (buffer_a, buffer_b, c) = (floats(&a), floats(&b), floats(&vec![0.0; n * n]));
        Dispatch {
            buffers: &[((0, 0, 0), &buffer_a), ((0, 1, 0), &buffer_b), ((0, 2, 0), &c)],
            push: &bytes(&[n as u32]),
            ..Dispatch::new(&shader, [groups, groups, 1])
        }
        .run()
        .unwrap();
        let expected: Vec<f32> =
            (0..n * n).map(|at| (0..n).map(|k| a[at / n * n + k] * b[k * n + at % n]).sum()).collect();
        close(&float_contents(&c), &expected, 1e-5);
    }
}

#[gaurast_runner::test(each = binaries())]
fn prefix_sum(case: &Case) {
    let shader = translated(case, "prefix_sum.comp", &Specialization::default());
    let mut random = Random(3);
    let values: Vec<u32> = (0..512).map(|_| random.next() % 1000).collect();
    let (sums, totals) = (buffer(&values), buffer(&[0; 2]));
    Dispatch { buffers: &[((0, 0, 0), &sums), ((0, 1, 0), &totals)], ..Dispatch::new(&shader, [2, 1, 1]) }
        .run()
        .unwrap();
    let mut expected = Vec::new();
    let mut expected_totals = Vec::new();
    for group in values.chunks(256) {
        let mut sum = 0;
        for value in group {
            expected.push(sum);
            sum += value;
        }
        expected_totals.push(sum);
    }
    assert_eq!(contents(&sums), expected);
    assert_eq!(contents(&totals), expected_totals);
}

#[gaurast_runner::test(each = binaries())]
fn n_body(case: &Case) {
    let shader = translated(case, "n_body.comp", &Specialization::default());
    let count = 100;
    let mut random = Random(11);
    let bodies: Vec<f32> = (0..8 * count).map(|_| random.unit() - 0.5).collect();
    let (before, after) = (floats(&bodies), floats(&vec![0.0; 8 * count]));
    let (step, softening) = (0.01_f32, 0.1_f32);
    let settings = floats(&[step, softening]);
    Dispatch {
        buffers: &[((0, 0, 0), &before), ((0, 1, 0), &after), ((0, 2, 0), &settings)],
        ..Dispatch::new(&shader, [2, 1, 1])
    }
    .run()
    .unwrap();
    let mut expected = bodies.clone();
    for index in 0..count {
        let own = &bodies[8 * index..8 * index + 8];
        let mut pull = [0.0_f32; 3];
        for other in bodies.chunks(8) {
            let apart: Vec<f32> = (0..3).map(|k| other[k] - own[k]).collect();
            let square: f32 = apart.iter().map(|a| a * a).sum::<f32>() + softening * softening;
            let factor = other[3] / (square * square * square).sqrt();
            for k in 0..3 {
                pull[k] += apart[k] * factor;
            }
        }
        for k in 0..3 {
            let velocity = own[4 + k] + pull[k] * step;
            expected[8 * index + 4 + k] = velocity;
            expected[8 * index + k] = own[k] + velocity * step;
        }
    }
    close(&float_contents(&after), &expected, 1e-4);
}

#[gaurast_runner::test(each = binaries())]
fn blur(case: &Case) {
    let mut specialization = Specialization::default();
    specialization.set(0, &3_i32.to_le_bytes());
    let shader = translated(case, "blur.comp", &specialization);
    let (width, height, radius) = (13_i32, 9_i32, 3_i32);
    let mut random = Random(5);
    let image: Vec<f32> = (0..4 * width * height).map(|_| random.unit()).collect();
    let (source, target) = (floats(&image), floats(&vec![0.0; image.len()]));
    Dispatch {
        buffers: &[((0, 0, 0), &source), ((0, 1, 0), &target)],
        push: &bytes(&[width.cast_unsigned(), height.cast_unsigned()]),
        ..Dispatch::new(&shader, [2, 2, 1])
    }
    .run()
    .unwrap();
    let weights = [0.4_f32, 0.25, 0.15, 0.1, 0.05];
    let mut expected = Vec::new();
    for at in 0..width * height {
        let (mut sum, mut total) = ([0.0_f32; 4], 0.0);
        for dy in -radius..=radius {
            for dx in -radius..=radius {
                let x = (at % width + dx).clamp(0, width - 1);
                let y = (at / width + dy).clamp(0, height - 1);
                let weight = weights[dx.unsigned_abs() as usize] * weights[dy.unsigned_abs() as usize];
                for (c, sum) in sum.iter_mut().enumerate() {
                    *sum += weight * image[4 * (y * width + x) as usize + c];
                }
                total += weight;
            }
        }
        expected.extend(sum.map(|sum| sum / total));
    }
    close(&float_contents(&target), &expected, 1e-5);
}

#[gaurast_runner::test(each = binaries())]
fn radix_sort(case: &Case) {
    let shader = translated(case, "radix_sort.comp", &Specialization::default());
    let mut random = Random(17);
    let keys: Vec<u32> = (0..512).map(|_| random.next()).collect();
    let sorted = buffer(&keys);
    Dispatch { buffers: &[((0, 0, 0), &sorted)], ..Dispatch::new(&shader, [2, 1, 1]) }.run().unwrap();
    let mut expected = keys;
    expected.chunks_mut(256).for_each(<[u32]>::sort_unstable);
    assert_eq!(contents(&sorted), expected);
}

mod control {
    pub fn switched(x: u32) -> u32 {
        let r = match x % 7 {
            0 => 10,
            1 => (1 + 3) * 5,
            2 => 5,
            5 => return 7777,
            4 => 1 + x,
            _ => 100 + x,
        };
        r * 2
    }

    pub fn early(x: u32) -> u32 {
        for i in 0..10 {
            if i == x % 13 {
                return i * 100;
            }
            if x >> i & 1 == 0 {
                continue;
            }
            for j in 0..=i {
                if j * i == x % 31 {
                    return j + 1000;
                }
            }
        }
        x
    }

    pub fn collatz(mut n: u32) -> u32 {
        let mut steps = 0;
        loop {
            n = if n & 1 == 0 { n / 2 } else { n.wrapping_mul(3).wrapping_add(1) };
            steps += 1;
            if n == 1 || steps >= 200 {
                return steps;
            }
        }
    }

    pub fn nested(x: u32) -> u32 {
        let (mut total, mut a, mut b) = (0_u32, x, 1_u32);
        for i in 0..8 {
            if a > b {
                std::mem::swap(&mut a, &mut b);
            }
            match i & 3 {
                0 => {
                    if x & 4 != 0 {
                        continue;
                    }
                    total = total.wrapping_add(a);
                }
                1 => {
                    for k in 0..x & 15 {
                        if k == 9 {
                            break;
                        }
                        if k & 1 == 0 {
                            total = total.wrapping_add(k.wrapping_mul(b));
                        }
                    }
                }
                2 => (a, b) = (b, a.wrapping_add(i)),
                _ if total > 5000 => total -= 5000,
                _ => total ^= x,
            }
            total = total.wrapping_mul(3).wrapping_add(1);
        }
        total.wrapping_add(a.wrapping_mul(b))
    }
}

#[gaurast_runner::test(each = binaries())]
fn control_flow(case: &Case) {
    let shader = translated(case, "control_flow.comp", &Specialization::default());
    let mut random = Random(23);
    let mut inputs: Vec<u32> = (0..256).collect();
    inputs.extend((0..256).map(|_| random.next() >> 1));
    let (source, results) = (buffer(&inputs), buffer(&vec![0; 4 * inputs.len()]));
    Dispatch { buffers: &[((0, 0, 0), &source), ((0, 1, 0), &results)], ..Dispatch::new(&shader, [8, 1, 1]) }
        .run()
        .unwrap();
    let results = contents(&results);
    for (x, found) in inputs.iter().zip(results.chunks(4)) {
        let expected = [control::switched(*x), control::early(*x), control::collatz(x + 1), control::nested(*x)];
        assert_eq!(found, expected, "x = {x}");
    }
}

#[gaurast_runner::test(each = binaries())]
fn dynamic_indices_and_layouts(case: &Case) {
    let shader = translated(case, "dynamic_index.comp", &Specialization::default());
    let keys: Vec<u32> = (0..32).map(|i| i * 7 % 23).collect();
    let (index, results) = (buffer(&keys), floats(&[0.0; 320]));
    // rows: a row-major mat3x2, two rows of three with a stride of 16 bytes; columns: two mat2 of stride 16; v.
    let mut block = vec![0.0_f32; 8 + 16 + 12];
    for row in 0..2 {
        for column in 0..3 {
            block[4 * row + column] = (10 * row + column) as f32;
        }
    }
    for matrix in 0..2 {
        for column in 0..2 {
            for row in 0..2 {
                block[8 + 8 * matrix + 4 * column + row] = (100 * matrix + 10 * column + row) as f32;
            }
        }
    }
    for element in 0..3 {
        block[24 + 4 * element + 1] = 0.5 + element as f32;
    }
    // An item: id, three weights, and a mat2x3 of stride 16 at byte 16.
    let item = |number: usize| {
        let mut words = [0_u32; 12];
        words[0] = number as u32;
        for k in 0..3 {
            words[1 + k] = (number as f32 + 0.25 * k as f32).to_bits();
        }
        for column in 0..2 {
            for row in 0..3 {
                words[4 + 4 * column + row] = ((number + 3 * column + row) as f32).to_bits();
            }
        }
        words
    };
    let mut items: Vec<u32> = (0..4).flat_map(item).collect();
    items.resize(12 * 36, 0);
    let (block, items) = (floats(&block), buffer(&items));
    Dispatch {
        buffers: &[((0, 0, 0), &index), ((0, 1, 0), &results), ((0, 2, 0), &block), ((0, 3, 0), &items)],
        ..Dispatch::new(&shader, [1, 1, 1])
    }
    .run()
    .unwrap();
    let (results, items) = (float_contents(&results), contents(&items));
    for (i, k) in keys.iter().map(|k| *k as usize).enumerate() {
        let mut vector = [1.0, 2.0, 3.0, 4.0];
        vector[k & 3] = 9.0;
        let mut m = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0_f32]];
        m[k % 3][(k + 1) % 3] += 0.5;
        let determinant = m[0][0] * (m[1][1] * m[2][2] - m[2][1] * m[1][2])
            - m[1][0] * (m[0][1] * m[2][2] - m[2][1] * m[0][2])
            + m[2][0] * (m[0][1] * m[1][2] - m[1][1] * m[0][2]);
        let flags = 0b00_1101 ^ 1 << (k % 6);
        let number = k % 4;
        let expected = [
            (k % 12 * (k % 12)) as f32,
            vector[(k + 1) & 3] + vector.iter().sum::<f32>(),
            determinant,
            (10 + k % 3) as f32,
            (100 * (k & 1) + 10 + (k >> 1 & 1)) as f32,
            0.5 + (k % 3) as f32,
            number as f32 + 0.25 * (k % 3) as f32 + number as f32,
            (number + 2) as f32 + 2.0 * (number + 5) as f32,
            flags as f32,
            2.0 + 10.0 * 12.0,
        ];
        close(&results[10 * i..10 * i + 10], &expected, 1e-5);
        let stored = &items[12 * (4 + i)..12 * (5 + i)];
        assert_eq!(stored[0] as usize, k);
        let stored: Vec<f32> = stored.iter().map(|bits| f32::from_bits(*bits)).collect();
        close(&stored[1..7], &[&expected[6..9], &expected[..3]].concat(), 1e-5);
        close(&stored[8..11], &expected[3..6], 1e-5);
    }
}

#[gaurast_runner::test(each = binaries())]
fn atomics(case: &Case) {
    let shader = translated(case, "atomics.comp", &Specialization::default());
    let cells = buffer(&[0; 20]);
    Dispatch { buffers: &[((0, 0, 0), &cells)], ..Dispatch::new(&shader, [2, 1, 1]) }.run().unwrap();
    let found = contents(&cells);
    for (cell, sum) in found[..16].iter().enumerate() {
        let expected: u32 = (0..128).filter(|i| i % 16 == cell as u32).sum();
        assert_eq!(*sum, expected);
    }
    assert_eq!(found[16..], [(-20_i32).cast_unsigned(), 107, 0, 63]);
}

#[gaurast_runner::test(each = binaries())]
fn subgroups(case: &Case) {
    let shader = translated(case, "subgroup.comp", &Specialization::default());
    let results = buffer(&[0; 24 * 64]);
    Dispatch { buffers: &[((0, 0, 0), &results)], ..Dispatch::new(&shader, [1, 1, 1]) }.run().unwrap();
    for (i, found) in (0..).zip(contents(&results).chunks(24)) {
        let (lane, group) = (i % 16, i / 16);
        let first = 16 * group;
        let members = first..first + 16;
        let odd_below = (0..lane).filter(|lane| lane & 1 == 1).count() as u32;
        let expected = [
            lane,
            group,
            members.clone().sum(),
            (first..=i).sum(),
            (first..i).sum(),
            members.clone().map(|i| i ^ 5).max().unwrap(),
            1 | u32::from(group == 0) << 1,
            0xaaaa,
            8,
            1,
            15,
            2 * (first + 3),
            i ^ 1,
            (0..4).map(|k| (i & !3) + k).sum(),
            i ^ 1,
            (i & !3) + 2,
            (1 << lane) - 1,
            0xffff & !((1 << lane) - 1),
            odd_below,
            lane & 1,
            if lane == 0 { found[20] } else { i - 1 },
            first + 7,
            u32::from(lane == 0),
            4016,
        ];
        assert_eq!(found, expected, "lane {i}");
    }
}

#[gaurast_runner::test(each = binaries())]
fn descriptor_arrays_and_runtime_lengths(case: &Case) {
    let shader = translated(case, "descriptor_arrays.comp", &Specialization::default());
    let arrays: Vec<_> = (0..4).map(|n| buffer(&vec![n + 1; 3 + n as usize])).collect();
    let results = buffer(&[0; 4]);
    Dispatch {
        buffers: &[
            ((0, 2, 0), &results),
            ((1, 3, 0), &arrays[0]),
            ((1, 3, 1), &arrays[1]),
            ((1, 3, 2), &arrays[2]),
            ((1, 3, 3), &arrays[3]),
        ],
        ..Dispatch::new(&shader, [1, 1, 1])
    }
    .run()
    .unwrap();
    assert_eq!(contents(&results), [44, 34, 24, 14]);
    for (n, array) in (0..).zip(&arrays) {
        assert_eq!(contents(array)[2], n + 50);
    }
}

#[gaurast_runner::test(each = binaries())]
fn wide_and_narrow_types(case: &Case) {
    let shader = translated(case, "wide.comp", &Specialization::default());
    let mut random = Random(99);
    let mut bytes = Vec::new();
    let d: Vec<f64> = (0..16).map(|i| f64::from(i) * 1.7).collect();
    let l: Vec<i64> = (0..16).map(|_| i64::from(random.next()) << 20).collect();
    let u: Vec<u64> = (0..16).map(|_| u64::from(random.next())).collect();
    let h: Vec<half::f16> = (0..16).map(|i| half::f16::from_f32(i as f32 * 0.3)).collect();
    let s: Vec<i16> = (0..16).map(|_| random.next() as i16).collect();
    let b: Vec<u8> = (0..16).map(|_| random.next() as u8).collect();
    let c: Vec<i8> = (0..16).map(|_| random.next() as i8).collect();
    bytes.extend(d.iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend(l.iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend(u.iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend(h.iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend(s.iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend(b.iter());
    bytes.extend(c.iter().map(|x| x.cast_unsigned()));
    let data: Vec<u32> = bytes.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().unwrap())).collect();
    let range = buffer(&data);
    Dispatch { buffers: &[((0, 0, 0), &range)], ..Dispatch::new(&shader, [1, 1, 1]) }.run().unwrap();
    let found: Vec<u8> = contents(&range).iter().flat_map(|word| word.to_le_bytes()).collect();
    for i in 0..16 {
        let wide = |base: usize| -> [u8; 8] { found[base + 8 * i..][..8].try_into().unwrap() };
        let pair = |base: usize| -> [u8; 2] { found[base + 2 * i..][..2].try_into().unwrap() };
        assert_eq!(f64::from_le_bytes(wide(0)), d[i].sqrt() * 2.0 + i as f64);
        assert_eq!(i64::from_le_bytes(wide(128)), l[i] / -3 + ((i as i64) << 40));
        assert_eq!(u64::from_le_bytes(wide(256)), u[i].wrapping_mul(0x1_0000_0001) >> 3);
        let product = half::f16::from_f32(h[i].to_f32() * 1.5);
        let expected = half::f16::from_f32(product.to_f32() + 0.25);
        assert_eq!(half::f16::from_le_bytes(pair(384)), expected);
        assert_eq!(i16::from_le_bytes(pair(416)), s[i].wrapping_mul(3));
        assert_eq!(found[448 + i], b[i].wrapping_add(200));
        assert_eq!(found[464 + i].cast_signed(), c[i].wrapping_sub(100));
    }
}

#[gaurast_runner::test(each = binaries())]
fn device_addresses(case: &Case) {
    struct OneBuffer(devmem::BufferRange);
    impl isa::resources::GlobalMemory for OneBuffer {
        fn find(&self, address: u64) -> Option<(&devmem::BufferRange, u64)> {
            let begin = 1 << 40;
            (begin..begin + self.0.size).contains(&address).then_some((&self.0, begin))
        }
    }
    let shader = translated(case, "addresses.comp", &Specialization::default());
    // A circle of nodes, each a value and the address of the next, 16 bytes apart.
    let address = |node: u32| -> u64 { (1 << 40) + 16 * u64::from(node % 5) };
    let nodes: Vec<u32> = (0..5)
        .flat_map(|node| {
            let next = address(node + 2);
            [100 + node, 0, next as u32, (next >> 32) as u32]
        })
        .collect();
    let memory = OneBuffer(buffer(&nodes));
    let results = buffer(&[0; 16]);
    Dispatch {
        buffers: &[((0, 0, 0), &results)],
        push: &address(0).to_le_bytes(),
        global: &memory,
        ..Dispatch::new(&shader, [1, 1, 1])
    }
    .run()
    .unwrap();
    let expected: Vec<u32> = (0..16).map(|i| 100 + 2 * i % 5).collect();
    assert_eq!(contents(&results), expected);
}
