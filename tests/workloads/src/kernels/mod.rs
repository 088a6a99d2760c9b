//! Realistic compute kernels with results computed on the host, for tests and benchmarks of shader cores.

mod context;
mod kernel;

pub use context::{Context, Prepared, Refused};
pub use kernel::{Expected, Kernel, Values};

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::borrow::Cow;

/// The amount of work of the kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// Enough to test the results.
    Small,
    /// Enough to measure the speed: some tens of milliseconds.
    Large,
}

impl Size {
    fn pick(self, small: u32, large: u32) -> u32 {
        match self {
            Self::Small => small,
            Self::Large => large,
        }
    }
}

macro_rules! spirv {
    ($name:literal) => {
        Cow::Borrowed(include_bytes!(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../driver/spirv/tests/shaders/",
            $name,
            ".comp.spv"
        )))
    };
}

/// A kernel's name, and its maker.
type Named = (&'static str, fn(Size) -> Kernel);

/// The kernels, by their names.
const KERNELS: [Named; 6] = [
    ("mandelbrot", mandelbrot),
    ("matrix product", matrix_product),
    ("prefix sum", prefix_sum),
    ("n-body", n_body),
    ("blur", blur),
    ("radix sort", radix_sort),
];

/// All kernels.
pub fn all(size: Size) -> Vec<Kernel> {
    KERNELS.iter().map(|(_, kernel)| kernel(size)).collect()
}

/// The kernel of a name.
pub fn named(name: &str, size: Size) -> Option<Kernel> {
    KERNELS.iter().find(|(own, _)| *own == name).map(|(_, kernel)| kernel(size))
}

fn bits(floats: &[f32]) -> Vec<u32> {
    floats.iter().map(|float| float.to_bits()).collect()
}

fn floats(count: usize, seed: u64) -> Vec<f32> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| random.random::<f32>() - 0.5).collect()
}

fn mandelbrot(size: Size) -> Kernel {
    let (width, height) = (size.pick(203, 1024), size.pick(101, 512));
    let limit = size.pick(100, 256);
    let count = |pixel: u32| {
        let cx = (pixel % width) as f32 / width as f32 * 3.0 - 2.25;
        let cy = (pixel / width) as f32 / height as f32 * 2.0 - 1.0;
        let (mut x, mut y) = (0f32, 0f32);
        for step in 0..limit {
            let (x2, y2) = (x * x, y * y);
            if x2 + y2 > 4.0 {
                return step;
            }
            (x, y) = (x2 - y2 + cx, 2.0 * x * y + cy);
        }
        limit
    };
    Kernel {
        name: "mandelbrot",
        spirv: spirv!("mandelbrot"),
        specialization: Vec::new(),
        buffers: vec![vec![u32::MAX; (width * height) as usize]],
        uniform: None,
        push: vec![width, height, limit],
        groups: [width.div_ceil(16), height.div_ceil(4), 1],
        expected: vec![Expected {
            binding: 0,
            values: Values::Exact((0..width * height).into_par_iter().map(count).collect()),
        }],
    }
}

fn matrix_product(size: Size) -> Kernel {
    let n = size.pick(64, 384) as usize;
    let (a, b) = (floats(n * n, 1), floats(n * n, 2));
    let element = |at: usize| {
        let products = (0..n).map(|k| f64::from(a[at / n * n + k]) * f64::from(b[k * n + at % n]));
        products.sum::<f64>() as f32
    };
    let expected = (0..n * n).into_par_iter().map(element).collect();
    Kernel {
        name: "matrix product",
        spirv: spirv!("matrix_product"),
        specialization: vec![(1, 16)],
        buffers: vec![bits(&a), bits(&b), vec![0; n * n]],
        uniform: None,
        push: vec![n as u32],
        groups: [n as u32 / 16, n as u32 / 16, 1],
        expected: vec![Expected { binding: 2, values: Values::Close(expected, 1e-5) }],
    }
}

fn prefix_sum(size: Size) -> Kernel {
    let groups = size.pick(9, 8192) as usize;
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let values: Vec<u32> = (0..256 * groups).map(|_| random.random_range(0..1000)).collect();
    let (mut sums, mut totals) = (Vec::with_capacity(values.len()), Vec::with_capacity(groups));
    for group in values.chunks_exact(256) {
        let mut sum = 0;
        for value in group {
            sums.push(sum);
            sum += value;
        }
        totals.push(sum);
    }
    Kernel {
        name: "prefix sum",
        spirv: spirv!("prefix_sum"),
        specialization: Vec::new(),
        buffers: vec![values, vec![0; groups]],
        uniform: None,
        push: Vec::new(),
        groups: [groups as u32, 1, 1],
        expected: vec![
            Expected { binding: 0, values: Values::Exact(sums) },
            Expected { binding: 1, values: Values::Exact(totals) },
        ],
    }
}

fn n_body(size: Size) -> Kernel {
    let count = size.pick(300, 4096) as usize;
    let bodies = floats(8 * count, 4);
    let (step, softening) = (0.01f32, 0.1f32);
    let moved = |own: &[f32]| {
        let mut pull = [0f64; 3];
        for other in bodies.chunks_exact(8) {
            let apart = [0, 1, 2].map(|k| f64::from(other[k]) - f64::from(own[k]));
            let square = apart.iter().map(|a| a * a).sum::<f64>() + f64::from(softening).powi(2);
            let factor = f64::from(other[3]) / square.powi(3).sqrt();
            pull.iter_mut().zip(apart).for_each(|(pull, apart)| *pull += apart * factor);
        }
        let mut after: [f32; 8] = std::array::from_fn(|k| own[k]);
        for k in 0..3 {
            after[4 + k] += pull[k] as f32 * step;
            after[k] += after[4 + k] * step;
        }
        after
    };
    let after: Vec<[f32; 8]> = bodies.par_chunks_exact(8).map(moved).collect();
    Kernel {
        name: "n-body",
        spirv: spirv!("n_body"),
        specialization: Vec::new(),
        buffers: vec![bits(&bodies), vec![0; 8 * count], bits(&[step, softening, 0.0, 0.0])],
        uniform: Some(2),
        push: Vec::new(),
        groups: [(count as u32).div_ceil(64), 1, 1],
        expected: vec![Expected { binding: 1, values: Values::Close(after.into_flattened(), 1e-3) }],
    }
}

fn blur(size: Size) -> Kernel {
    let (width, height) = (size.pick(61, 640) as i32, size.pick(43, 480) as i32);
    let radius = 3i32;
    let weights = [0.4f32, 0.25, 0.15, 0.1, 0.05];
    let image = floats(4 * (width * height) as usize, 5);
    let pixel = |at: i32| {
        let (mut sum, mut total) = ([0f32; 4], 0f32);
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
        sum.map(|sum| sum / total)
    };
    let blurred: Vec<[f32; 4]> = (0..width * height).into_par_iter().map(pixel).collect();
    Kernel {
        name: "blur",
        spirv: spirv!("blur"),
        specialization: vec![(0, radius.cast_unsigned())],
        buffers: vec![bits(&image), vec![0; image.len()]],
        uniform: None,
        push: vec![width.cast_unsigned(), height.cast_unsigned()],
        groups: [(width as u32).div_ceil(8), (height as u32).div_ceil(8), 1],
        expected: vec![Expected { binding: 1, values: Values::Close(blurred.into_flattened(), 1e-5) }],
    }
}

fn radix_sort(size: Size) -> Kernel {
    let groups = size.pick(5, 256) as usize;
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let keys: Vec<u32> = (0..256 * groups).map(|_| random.random()).collect();
    let mut sorted = keys.clone();
    sorted.par_chunks_exact_mut(256).for_each(<[u32]>::sort_unstable);
    Kernel {
        name: "radix sort",
        spirv: spirv!("radix_sort"),
        specialization: Vec::new(),
        buffers: vec![keys],
        uniform: None,
        push: Vec::new(),
        groups: [groups as u32, 1, 1],
        expected: vec![Expected { binding: 0, values: Values::Exact(sorted) }],
    }
}
