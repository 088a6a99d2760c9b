//! Tests of functions of GLSL.std.450 against f64 or exact models, within the precision that Vulkan requires.

use crate::common::{Dispatch, OPTIONS, Random, buffer, contents, float_contents, rewritten, translated, words_of};
use gaurast_spirv::{Module, Shader, Specialization, Stage, translate};

/// The allowed difference between a result and the model's.
#[derive(Clone, Copy)]
enum Tolerance {
    Exact,
    /// Units in the last place.
    Ulp(f64),
    Absolute(f64),
    /// Relative to the largest operand.
    Relative(f64),
}
use Tolerance::{Absolute, Exact, Relative, Ulp};

type Model = fn(f64, f64, f64) -> f64;

fn length(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn determinant(m: &[Vec<f64>]) -> f64 {
    if m.len() == 1 {
        return m[0][0];
    }
    (0..m.len())
        .map(|column| {
            let rest: Vec<Vec<f64>> = m[1..]
                .iter()
                .map(|row| {
                    let mut row = row.clone();
                    row.remove(column);
                    row
                })
                .collect();
            let sign = if column % 2 == 0 { 1.0 } else { -1.0 };
            sign * m[0][column] * determinant(&rest)
        })
        .sum()
}

/// The functions, with their models and Vulkan's tolerances. sinh(log(x)) and the like have the error of the functions
/// that they are derived from.
const FLOATS: &[(&str, Model, Tolerance)] = &[
    ("round", |x, _, _| x.round_ties_even(), Exact),
    ("roundEven", |x, _, _| x.round_ties_even(), Exact),
    ("trunc", |x, _, _| x.trunc(), Exact),
    ("abs", |x, _, _| x.abs(), Exact),
    ("sign", |x, _, _| if x == 0.0 { 0.0 } else { x.signum() }, Exact),
    ("floor", |x, _, _| x.floor(), Exact),
    ("ceil", |x, _, _| x.ceil(), Exact),
    ("fract", |x, _, _| x - x.floor(), Ulp(1.0)),
    ("radians", |x, _, _| x.to_radians(), Ulp(3.0)),
    ("degrees", |x, _, _| x.to_degrees(), Ulp(3.0)),
    ("sin", |x, _, _| x.sin(), Absolute(4.9e-4)),
    ("cos", |x, _, _| x.cos(), Absolute(4.9e-4)),
    ("tan", |x, _, _| x.tan(), Relative(1e-3)),
    ("asin", |x, _, _| (x / 8.0).asin(), Ulp(4096.0)),
    ("acos", |x, _, _| (x / 8.0).acos(), Ulp(4096.0)),
    ("atan", |x, _, _| x.atan(), Ulp(4096.0)),
    ("sinh", |x, _, _| x.sinh(), Relative(1e-5)),
    ("cosh", |x, _, _| x.cosh(), Relative(1e-5)),
    ("tanh", |x, _, _| x.tanh(), Relative(1e-5)),
    ("asinh", |x, _, _| x.asinh(), Relative(1e-5)),
    ("acosh", |x, _, _| (x.abs() + 1.0).acosh(), Relative(1e-3)),
    ("atanh", |x, _, _| (x / 9.0).atanh(), Relative(1e-5)),
    ("atan2", |x, y, _| x.atan2(y), Ulp(4096.0)),
    ("pow", |x, y, _| x.abs().powf(y), Relative(1e-4)),
    ("exp", |x, _, _| x.exp(), Ulp(20.0)),
    ("log", |x, _, _| f64::from(x.abs() as f32 + 0.1).ln(), Absolute(5e-7)),
    ("exp2", |x, _, _| x.exp2(), Ulp(20.0)),
    ("log2", |x, _, _| f64::from(x.abs() as f32 + 0.1).log2(), Absolute(5e-7)),
    ("sqrt", |x, _, _| x.abs().sqrt(), Ulp(3.0)),
    ("inversesqrt", |x, _, _| f64::from(x.abs() as f32 + 0.1).sqrt().recip(), Ulp(2.0)),
    ("modf fraction", |x, _, _| x.fract(), Exact),
    ("modf whole", |x, _, _| x.trunc(), Exact),
    ("min", |x, y, _| x.min(y), Exact),
    ("max", |x, y, _| x.max(y), Exact),
    ("clamp", |x, _, z| x.max(-1.0).min(z), Exact),
    ("mix", |x, y, z| x * (1.0 - z) + y * z, Relative(1e-6)),
    ("step", |x, y, _| if y < x { 0.0 } else { 1.0 }, Exact),
    (
        "smoothstep",
        |x, _, _| {
            let t = ((x + 2.0) / 5.0).clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
        },
        Absolute(1e-6),
    ),
    ("fma", |x, y, z| x * y + z, Relative(1e-6)),
    ("frexp significand", |x, _, _| frexp(x).0, Exact),
    ("frexp exponent", |x, _, _| frexp(x).1, Exact),
    ("ldexp", |x, y, _| x * y.trunc().exp2(), Exact),
    ("length", |x, y, z| length(&[x, y, z]), Relative(1e-6)),
    ("distance", |x, y, z| length(&[x - 1.0, y - 2.0, z - 3.0]), Relative(1e-6)),
    ("cross", |x, _, z| z - x * 3.0, Relative(1e-6)),
    ("normalize", |x, y, z| x / length(&[x, y, z]), Ulp(8.0)),
    ("faceforward", |x, _, z| if z + 2.0 * x < 0.0 { x } else { -x }, Exact),
    ("reflect", |x, y, _| y - 2.0 * (0.6 * x + 0.8 * y) * 0.8, Relative(1e-6)),
    ("refract", refracted, Absolute(2e-6)),
    (
        "determinant",
        |x, y, z| determinant(&[vec![x, y, z, 1.0], vec![y, x, 2.0, z], vec![1.0, 2.0, x, y], vec![z, 1.0, y, 3.0]]),
        Absolute(5e-3),
    ),
    ("inverse", inverse_1_2, Absolute(1e-7)),
    (
        "mod",
        |x, y, _| {
            let d = f64::from(y as f32 + 5.0);
            x - d * (x / d).floor()
        },
        Absolute(1e-5),
    ),
    ("remainder by hand", |x, y, _| x - y * (x / y).trunc(), Absolute(1e-5)),
    ("dot", |x, y, z| 2.0 * x * z + y * y + 2.0, Relative(1e-6)),
];

fn frexp(x: f64) -> (f64, f64) {
    if x == 0.0 {
        return (x, 0.0);
    }
    let exponent = x.abs().log2().floor() + 1.0;
    (x / exponent.exp2(), exponent)
}

fn refracted(x: f64, y: f64, _: f64) -> f64 {
    let size = length(&[x, y]);
    let (x, y) = (x / size, y / size);
    let along = 0.6 * x + 0.8 * y;
    let k = 1.0 - 0.25 * (1.0 - along * along);
    0.5 * x - (0.5 * along + k.sqrt()) * 0.6
}

/// Element (row 2, column 1) of the inverse of the shader's matrix, whose columns are in the function.
fn inverse_1_2(x: f64, y: f64, z: f64) -> f64 {
    let columns = [[x + 20.0, y, z], [1.0, y + 30.0, 2.0], [x, 1.0, 25.0]];
    let transposed: Vec<Vec<f64>> = (0..3).map(|row| columns.iter().map(|column| column[row]).collect()).collect();
    // The cofactor of row 1, column 2.
    let minor = transposed[0][0] * transposed[2][1] - transposed[0][1] * transposed[2][0];
    -minor / determinant(&transposed)
}

fn run_floats(shader: &Shader, inputs: &[f32]) -> Vec<f32> {
    let data: Vec<u32> = inputs.iter().map(|value| value.to_bits()).collect();
    let (source, results) = (buffer(&data), buffer(&vec![0; 64 * FLOATS.len()]));
    Dispatch { buffers: &[((0, 0, 0), &source), ((0, 1, 0), &results)], ..Dispatch::new(shader, [1, 1, 1]) }
        .run()
        .unwrap();
    float_contents(&results)
}

fn check_floats(shader: &Shader, inputs: &[f32]) {
    let results = run_floats(shader, inputs);
    for ((name, model, tolerance), found) in FLOATS.iter().zip(results.chunks(64)) {
        for (lane, found) in found.iter().enumerate() {
            let [x, y, z] = [0, 64, 128].map(|first| f64::from(inputs[first + lane]));
            let expected = model(x, y, z);
            let error = (f64::from(*found) - expected).abs();
            let ulp = f64::from(f32::EPSILON) * expected.abs().max(f64::from(f32::MIN_POSITIVE));
            let allowed = match tolerance {
                Exact => 0.0,
                Ulp(count) => count * ulp,
                Absolute(allowed) => *allowed,
                Relative(factor) => factor * expected.abs().max(x.abs()).max(y.abs()).max((x * y).abs()).max(1e-3),
            };
            assert!(error <= allowed, "{name}({x}, {y}, {z}) is {found}, not {expected}: off by {error:e}");
        }
    }
}

#[gaurast_runner::test]
fn float_functions() {
    let mut random = Random(31);
    let mut inputs: Vec<f32> = (0..192).map(|_| 8.0 * (random.unit() - 0.5)).collect();
    inputs[128..].iter_mut().for_each(|z| *z = z.abs() / 4.0);
    inputs[..6].copy_from_slice(&[0.5, 1.5, 2.5, -0.5, 3.0, -3.0]);
    let shader = translated("glsl_floats.comp", &Specialization::default());
    check_floats(&shader, &inputs);

    // The same with NMin, NMax and NClamp in place of FMin, FMax and FClamp.
    let mut replaced = 0;
    let words = rewritten(&words_of("glsl_floats.comp"), |instruction| {
        let mut changed = instruction.to_vec();
        if instruction[0] & 0xffff == 12 {
            changed[4] = match instruction[4] {
                37 => 79,
                40 => 80,
                43 => 81,
                same => same,
            };
            replaced += u32::from(changed[4] != instruction[4]);
        }
        changed
    });
    assert_eq!(replaced, 3);
    let module = Module::parse(&words).unwrap();
    let specialization = Specialization::default();
    let shader = translate(&module, "main", Stage::Compute, &specialization, &OPTIONS).unwrap();
    check_floats(&shader, &inputs);
}

/// A matrix near the identity, its columns one after the other, as halves.
fn half_matrix(random: &mut Random) -> [half::f16; 16] {
    std::array::from_fn(|index| {
        let diagonal = if index % 5 == 0 { 3.0 } else { 0.0 };
        half::f16::from_f32(diagonal + 2.0 * (random.unit() - 0.5))
    })
}

#[gaurast_runner::test]
fn inverses_of_halves_are_rounded_once() {
    let mut random = Random(41);
    let matrices: Vec<[half::f16; 16]> = (0..64).map(|_| half_matrix(&mut random)).collect();
    let words: Vec<u32> = matrices.iter().flatten().map(|value| value.to_f32().to_bits()).collect();
    let (source, inverses, determinants) = (buffer(&words), buffer(&vec![0; 16 * 64]), buffer(&vec![0; 64]));
    let shader = translated("half_matrix.comp", &Specialization::default());
    Dispatch {
        buffers: &[((0, 0, 0), &source), ((0, 1, 0), &inverses), ((0, 2, 0), &determinants)],
        ..Dispatch::new(&shader, [1, 1, 1])
    }
    .run()
    .unwrap();
    let (inverses, determinants) = (float_contents(&inverses), float_contents(&determinants));
    // Half a unit in the last place of a half, plus the error of binary32.
    let close = |found: f32, exact: f64, what: &str| {
        let unit = (exact.abs().log2().floor().max(-14.0) - 10.0).exp2();
        let error = (f64::from(found) - exact).abs();
        assert!(error <= 0.51 * unit, "{what}: {found}, not {exact}");
    };
    for (lane, matrix) in matrices.iter().enumerate() {
        let rows: Vec<Vec<f64>> =
            (0..4).map(|row| (0..4).map(|column| matrix[4 * column + row].to_f64()).collect()).collect();
        let exact = determinant(&rows);
        close(determinants[lane], exact, "determinant");
        for (row, column) in (0..16).map(|index| (index / 4, index % 4)) {
            let minor: Vec<Vec<f64>> = (0..4)
                .filter(|other| *other != column)
                .map(|from| {
                    let others = (0..4).filter(|other| *other != row);
                    others.map(|other| rows[from][other]).collect()
                })
                .collect();
            let sign = if (row + column) % 2 == 0 { 1.0 } else { -1.0 };
            let element = sign * determinant(&minor) / exact;
            let found = inverses[16 * lane + 4 * column + row];
            close(found, element, &format!("matrix {lane}, row {row}, column {column}"));
        }
    }
}

type Exactly = fn(u32, u32, [f32; 4]) -> u32;

fn bits(value: f32) -> u32 {
    value.to_bits()
}

fn signed(value: i32) -> u32 {
    value.cast_unsigned()
}

fn s(value: u32) -> i32 {
    value.cast_signed()
}

fn snorm(value: f32, scale: f32) -> u32 {
    signed((value.clamp(-1.0, 1.0) * scale).round_ties_even() as i32)
}

fn unorm(value: f32, scale: f32) -> u32 {
    (value.clamp(0.0, 1.0) * scale).round_ties_even() as u32
}

const INTEGERS: &[(&str, Exactly)] = &[
    ("abs", |x, _, _| signed(s(x).wrapping_abs())),
    ("sign", |x, _, _| signed(s(x).signum())),
    ("smin", |x, y, _| signed(s(x).min(s(y)))),
    ("smax", |x, y, _| signed(s(x).max(s(y)))),
    ("sclamp", |x, _, _| signed(s(x).clamp(-9, 9))),
    ("umin", |x, y, _| x.min(y)),
    ("umax", |x, y, _| x.max(y)),
    ("uclamp", |x, _, _| x.clamp(5, 77)),
    ("findLSB", |x, _, _| if x == 0 { u32::MAX } else { x.trailing_zeros() }),
    ("findMSB int", |x, _, _| {
        let y = if s(x) < 0 { !x } else { x };
        if y == 0 { u32::MAX } else { 31 - y.leading_zeros() }
    }),
    ("findMSB uint", |x, _, _| if x == 0 { u32::MAX } else { 31 - x.leading_zeros() }),
    ("bitCount", |x, _, _| x.count_ones()),
    ("bitfieldReverse", |x, _, _| x.reverse_bits()),
    ("bitfieldExtract int", |x, y, _| signed(s(x << (25 - (y & 15))) >> 25)),
    ("bitfieldExtract uint", |x, y, _| x << (25 - (y & 15)) >> 25),
    ("bitfieldInsert", |x, y, _| x & !(0x1ff << 5) | (y & 0x1ff) << 5),
    ("uaddCarry", |x, y, _| x.wrapping_add(y)),
    ("carry", |x, y, _| u32::from(x.checked_add(y).is_none())),
    ("usubBorrow", |x, y, _| x.wrapping_sub(y)),
    ("borrow", |x, y, _| u32::from(x < y)),
    ("umulExtended high", |x, y, _| ((u64::from(x) * u64::from(y)) >> 32) as u32),
    ("umulExtended low", |x, y, _| x.wrapping_mul(y)),
    ("imulExtended high", |x, y, _| ((i64::from(s(x)) * i64::from(s(y))) >> 32) as u32),
    ("udiv", |x, y, _| x / (y | 1)),
    ("umod", |x, y, _| x % (y | 1)),
    ("sdiv", |x, y, _| signed(s(x).wrapping_div(s(y) | 1))),
    ("arithmetic shift", |x, _, _| signed(s(x) >> 3)),
    ("logical shift", |x, y, _| x >> (y & 31)),
    ("not", |x, _, _| !x),
    ("negate", |x, _, _| x.wrapping_neg()),
    ("packSnorm4x8", |_, _, v| (0..4).map(|k| (snorm(v[k], 127.0) & 0xff) << (8 * k)).sum()),
    ("packUnorm4x8", |_, _, v| (0..4).map(|k| unorm(v[k], 255.0) << (8 * k)).sum()),
    ("packSnorm2x16", |_, _, v| (0..2).map(|k| (snorm(v[k], 32767.0) & 0xffff) << (16 * k)).sum()),
    ("packUnorm2x16", |_, _, v| (0..2).map(|k| unorm(v[k], 65535.0) << (16 * k)).sum()),
    ("packHalf2x16", |_, _, v| (0..2).map(|k| u32::from(half::f16::from_f32(v[k]).to_bits()) << (16 * k)).sum()),
    ("unpackSnorm4x8", |x, _, _| bits((f32::from((x >> 8) as i8) / 127.0).max(-1.0))),
    ("unpackUnorm4x8", |x, _, _| bits((x >> 24) as f32 / 255.0)),
    ("unpackSnorm2x16", |x, _, _| bits((f32::from(x as i16) / 32767.0).max(-1.0))),
    ("unpackUnorm2x16", |x, _, _| bits((x >> 16) as f32 / 65535.0)),
    ("unpackHalf2x16", |x, _, _| bits(half::f16::from_bits((x >> 16 & 0x3fff) as u16).to_f32())),
    ("packDouble2x32", |_, y, _| y),
    ("float to uint", |x, _, _| x as f32 as u32),
    ("float to int", |x, _, _| signed((s(x) as f32 / 4.0) as i32)),
    ("int to float", |x, _, _| bits(s(x) as f32)),
    ("isnan and isinf", |x, _, _| {
        let x = f32::from_bits(x);
        u32::from(x.is_nan()) + 2 * u32::from(x.is_infinite())
    }),
];

#[gaurast_runner::test]
fn integer_functions() {
    let mut random = Random(37);
    let mut inputs: Vec<u32> = (0..128).map(|_| random.next() >> random.below(32)).collect();
    let extremes = [0, 1, u32::MAX, 1 << 31, i32::MAX.cast_unsigned(), 0x7f80_0000, 0xff80_0000, 0x7fc0_0000];
    inputs[..8].copy_from_slice(&extremes);
    inputs[70..78].copy_from_slice(&extremes);
    let vectors: Vec<f32> = (0..256).map(|_| 2.4 * (random.unit() - 0.5)).collect();
    inputs.extend(vectors.iter().map(|value| value.to_bits()));
    let shader = translated("glsl_integers.comp", &Specialization::default());
    let (source, results) = (buffer(&inputs), buffer(&vec![0; 64 * INTEGERS.len()]));
    Dispatch { buffers: &[((0, 0, 0), &source), ((0, 1, 0), &results)], ..Dispatch::new(&shader, [1, 1, 1]) }
        .run()
        .unwrap();
    let results = contents(&results);
    for ((name, model), found) in INTEGERS.iter().zip(results.chunks(64)) {
        for (lane, found) in found.iter().enumerate() {
            let (x, y) = (inputs[lane], inputs[64 + lane]);
            let v: [f32; 4] = vectors[4 * lane..4 * lane + 4].try_into().unwrap();
            let expected = model(x, y, v);
            assert_eq!(*found, expected, "{name}({x:#x}, {y:#x}, {v:?})");
        }
    }
}
