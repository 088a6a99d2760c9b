//! Kept compute shaders run on the shader cores and give what the host computes.

mod common;

use common::{Dispatch, Random, buffer, contents, float_contents, floats, translated};
use vulkan_gaurast::shader::Specialization;

fn bytes(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

fn close(found: &[f32], expected: &[f32], tolerance: f32) {
    assert_eq!(found.len(), expected.len());
    for (index, (found, expected)) in found.iter().zip(expected).enumerate() {
        let error = (found - expected).abs();
        assert!(
            error <= tolerance * expected.abs().max(1.0),
            "element {index}: {found} instead of {expected}"
        );
    }
}

#[test]
fn mandelbrot() {
    let shader = translated("mandelbrot.comp", &Specialization::default());
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

#[test]
fn matrix_product_with_a_specialized_tile() {
    for (tile, groups) in [(None, 4), (Some(16_u32), 2)] {
        let mut specialization = Specialization::default();
        if let Some(tile) = tile {
            specialization.set(1, &tile.to_le_bytes());
        }
        let shader = translated("matrix_product.comp", &specialization);
        let n = 32;
        assert_eq!(shader.interface.workgroup_size[0], tile.unwrap_or(8));
        let mut random = Random(7);
        let mut matrix = || -> Vec<f32> { (0..n * n).map(|_| random.unit() - 0.5).collect() };
        let (a, b) = (matrix(), matrix());
        let (buffer_a, buffer_b, c) = (floats(&a), floats(&b), floats(&vec![0.0; n * n]));
        Dispatch {
            buffers: &[
                ((0, 0, 0), &buffer_a),
                ((0, 1, 0), &buffer_b),
                ((0, 2, 0), &c),
            ],
            push: &bytes(&[n as u32]),
            ..Dispatch::new(&shader, [groups, groups, 1])
        }
        .run()
        .unwrap();
        let expected: Vec<f32> = (0..n * n)
            .map(|at| (0..n).map(|k| a[at / n * n + k] * b[k * n + at % n]).sum())
            .collect();
        close(&float_contents(&c), &expected, 1e-5);
    }
}

#[test]
fn prefix_sum() {
    let shader = translated("prefix_sum.comp", &Specialization::default());
    let mut random = Random(3);
    let values: Vec<u32> = (0..512).map(|_| random.next() % 1000).collect();
    let (sums, totals) = (buffer(&values), buffer(&[0; 2]));
    Dispatch {
        buffers: &[((0, 0, 0), &sums), ((0, 1, 0), &totals)],
        ..Dispatch::new(&shader, [2, 1, 1])
    }
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

#[test]
fn n_body() {
    let shader = translated("n_body.comp", &Specialization::default());
    let count = 100;
    let mut random = Random(11);
    let bodies: Vec<f32> = (0..8 * count).map(|_| random.unit() - 0.5).collect();
    let (before, after) = (floats(&bodies), floats(&vec![0.0; 8 * count]));
    let (step, softening) = (0.01_f32, 0.1_f32);
    let settings = floats(&[step, softening]);
    Dispatch {
        buffers: &[
            ((0, 0, 0), &before),
            ((0, 1, 0), &after),
            ((0, 2, 0), &settings),
        ],
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

#[test]
fn blur() {
    let mut specialization = Specialization::default();
    specialization.set(0, &3_i32.to_le_bytes());
    let shader = translated("blur.comp", &specialization);
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
                let weight =
                    weights[dx.unsigned_abs() as usize] * weights[dy.unsigned_abs() as usize];
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

#[test]
fn radix_sort() {
    let shader = translated("radix_sort.comp", &Specialization::default());
    let mut random = Random(17);
    let keys: Vec<u32> = (0..512).map(|_| random.next()).collect();
    let sorted = buffer(&keys);
    Dispatch {
        buffers: &[((0, 0, 0), &sorted)],
        ..Dispatch::new(&shader, [2, 1, 1])
    }
    .run()
    .unwrap();
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
            n = if n & 1 == 0 {
                n / 2
            } else {
                n.wrapping_mul(3).wrapping_add(1)
            };
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

#[test]
fn control_flow() {
    let shader = translated("control_flow.comp", &Specialization::default());
    let mut random = Random(23);
    let mut inputs: Vec<u32> = (0..256).collect();
    inputs.extend((0..256).map(|_| random.next() >> 1));
    let (source, results) = (buffer(&inputs), buffer(&vec![0; 4 * inputs.len()]));
    Dispatch {
        buffers: &[((0, 0, 0), &source), ((0, 1, 0), &results)],
        ..Dispatch::new(&shader, [8, 1, 1])
    }
    .run()
    .unwrap();
    let results = contents(&results);
    for (x, found) in inputs.iter().zip(results.chunks(4)) {
        let expected = [
            control::switched(*x),
            control::early(*x),
            control::collatz(x + 1),
            control::nested(*x),
        ];
        assert_eq!(found, expected, "x = {x}");
    }
}
