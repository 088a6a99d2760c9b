//! Tests of shaders on the shader cores, most of them in SPIR-V assembly because GLSL can't express them. Each row of
//! results is compared with the host's.

use crate::common::{Dispatch, Random, buffer, contents, floats, rewritten, translated, words_of};
use devmem::BufferRange;
use gaurast_spirv::{Module, Specialization};

/// Invocations of each shader here.
const LANES: usize = 64;

/// Runs a shader over the buffers at its bindings, whose last has these rows of 32-bit results.
fn run(name: &str, operands: &[&BufferRange], words: usize) -> Vec<u32> {
    let shader = translated(name, &Specialization::default());
    let results = buffer(&vec![0xdead_beef; words]);
    let all: Vec<_> = (0..)
        .zip(operands.iter().copied().chain([&results]))
        .map(|(binding, range)| ((0, binding, 0), range))
        .collect();
    Dispatch { buffers: &all, ..Dispatch::new(&shader, [1, 1, 1]) }.run().unwrap();
    contents(&results)
}

/// As [`run`], over one buffer of 64-bit operands and with rows of 64-bit results.
fn run_wide(name: &str, operands: &[u64], rows: usize) -> Vec<Vec<u64>> {
    let words: Vec<u32> = operands.iter().flat_map(|value| [*value as u32, (*value >> 32) as u32]).collect();
    let results = run(name, &[&buffer(&words)], 2 * LANES * rows);
    let results: Vec<u64> = results.chunks_exact(2).map(|pair| u64::from(pair[1]) << 32 | u64::from(pair[0])).collect();
    results.chunks(LANES).map(<[u64]>::to_vec).collect()
}

fn random_long(random: &mut Random) -> u64 {
    let long = u64::from(random.next()) << 32 | u64::from(random.next());
    long >> random.below(64)
}

/// The low bits of a number.
fn low(value: u128, width: u32) -> u64 {
    (value & ((1 << width) - 1)) as u64
}

/// The low bits of a number, read as a signed one.
fn signed(value: u64, width: u32) -> i128 {
    i128::from((value << (64 - width)).cast_signed() >> (64 - width))
}

#[gaurast_runner::test]
fn extended_arithmetic_of_all_widths() {
    let mut random = Random(71);
    let mut operands: Vec<u64> = (0..2 * LANES).map(|_| random_long(&mut random)).collect();
    let extremes = [0, 1, u64::MAX, 1 << 63, i64::MAX as u64, 0x80, 0x8000, 0xff];
    operands[..8].copy_from_slice(&extremes);
    operands[LANES + 2..LANES + 10].copy_from_slice(&extremes);
    let rows = run_wide("extended_arithmetic.comp", &operands, 24);
    for (index, row) in rows.iter().enumerate() {
        let width = [8, 16, 64][index / 8];
        for (lane, found) in row.iter().enumerate() {
            let a = u128::from(operands[lane]) & ((1 << width) - 1);
            let b = u128::from(operands[LANES + lane]) & ((1 << width) - 1);
            let product = signed(a as u64, width) * signed(b as u64, width);
            let whole = match index % 8 / 2 {
                0 => a + b,
                1 if index % 2 == 0 => a.wrapping_sub(b),
                1 => u128::from(a < b) << width,
                2 => a * b,
                _ => product.cast_unsigned(),
            };
            let expected = low(whole >> (width * (index as u32 % 2)), width);
            // The bits of a signed result beyond its width are ignored.
            assert_eq!(low(u128::from(*found), width), expected, "row {index}, lane {lane}: {a:#x} {b:#x}");
        }
    }
}

/// The binary16 with the greatest magnitude that is not beyond a number.
fn towards_zero(value: f64) -> half::f16 {
    if !value.is_finite() {
        return half::f16::from_f64(value);
    }
    // All finite magnitudes in order.
    let mut magnitudes = (0..=0x7BFF).map(|bits| half::f16::from_bits(bits).to_f64());
    let below = magnitudes.rfind(|it| *it <= value.abs()).unwrap();
    half::f16::from_f64(below.copysign(value))
}

/// The binary16 that is nearest to a number, the even one of two. (`f16::from_f64` rounds twice on some processors.)
fn nearest(value: f64) -> half::f16 {
    let below = towards_zero(value);
    if !value.is_finite() {
        return below;
    }
    let above = half::f16::from_bits(below.to_bits() + 1);
    // Beyond the greatest number the next one would be 2^16.
    let magnitude = |number: half::f16| if number.is_finite() { number.to_f64().abs() } else { 65536.0 };
    let [down, up] = [below, above].map(|number| (value.abs() - magnitude(number)).abs());
    let is_above = up < down || up == down && below.to_bits() % 2 == 1;
    if is_above { above } else { below }
}

#[gaurast_runner::test]
fn conversions_round_as_they_are_decorated() {
    let mut random = Random(79);
    let ends = [
        0.0,
        -0.0,
        1.0 + 1.0 / 1024.0,
        1.0 + 0.75 / 1024.0,
        65504.0,
        65519.9,
        65536.0,
        -1e30,
        2f64.powi(-14) * (1.0 - 1e-5),
        2f64.powi(-24) * 0.99,
        -2f64.powi(-25),
        1e-300,
        -f64::MAX,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ];
    let mut wide: Vec<f64> = ends.to_vec();
    while wide.len() < LANES {
        let exponent = random.below(44) as i32 - 27;
        let mantissa = 1.0 + f64::from(random.next()) / f64::from(u32::MAX);
        let sign = if random.below(2) == 0 { 1.0 } else { -1.0 };
        wide.push(sign * mantissa * 2f64.powi(exponent));
    }
    let narrow: Vec<u32> = wide.iter().map(|it| (*it as f32).to_bits()).collect();
    let words: Vec<u32> = wide.iter().flat_map(|it| [it.to_bits() as u32, (it.to_bits() >> 32) as u32]).collect();
    let operands = [&buffer(&narrow), &buffer(&words)];
    let results = run("towards_zero.comp", &operands, 2 * LANES);
    let results: Vec<u16> = results.iter().flat_map(|word| [*word as u16, (*word >> 16) as u16]).collect();
    for (lane, value) in wide.iter().enumerate() {
        let float = *value as f32;
        let expected =
            [towards_zero(f64::from(float)), half::f16::from_f32(float), towards_zero(*value), nearest(*value)];
        for (row, expected) in expected.into_iter().enumerate() {
            let found = results[row * LANES + lane];
            assert_eq!(found, expected.to_bits(), "row {row}: {value:e}");
        }
    }
}

#[gaurast_runner::test]
fn bit_fields_with_wide_offsets_and_exponents() {
    let mut random = Random(73);
    let mut operands: Vec<u64> = (0..2 * LANES).map(|_| random_long(&mut random)).collect();
    let most = |lane: usize| {
        if lane < 24 {
            16
        } else if lane < 48 {
            32
        } else {
            64
        }
    };
    let offsets: Vec<u64> = (0..LANES).map(|lane| random.below(most(lane)) as u64).collect();
    let counts: Vec<u64> = (0..LANES)
        .map(|lane| match lane {
            0 => 0,
            lane => random.below(most(lane) - offsets[lane] as usize + 1) as u64,
        })
        .collect();
    let mut exponents: Vec<u64> = (0..LANES).map(|_| (random.below(300) as i64 - 150).cast_unsigned()).collect();
    let far = [i64::MAX, i64::MIN, 1 << 32, -1 << 32, (1 << 40) + 3, 0];
    exponents[..6].copy_from_slice(&far.map(i64::cast_unsigned));
    operands.extend(offsets.iter().chain(&counts).chain(&exponents));
    let rows = run_wide("bit_fields.comp", &operands, 13);
    for (lane, ((offset, count), exponent)) in offsets.iter().zip(&counts).zip(&exponents).enumerate() {
        let (base, insert) = (operands[lane], operands[LANES + lane]);
        let mask = low(u128::MAX, *count as u32);
        for (first, width) in [(0, 32), (3, 16), (6, 64)] {
            if offset + count > u64::from(width) {
                continue;
            }
            let own = low(u128::from(base), width);
            let field = own.checked_shr(*offset as u32).unwrap_or(0) & mask;
            let moved = (u128::from(insert & mask) << offset) as u64;
            let kept = own & !((u128::from(mask) << offset) as u64);
            let sign = match count {
                0 => 0,
                count => signed(field, *count as u32) as u64,
            };
            let what = format!("lane {lane}: {base:#x} {insert:#x} {offset} {count}, {width} bits");
            assert_eq!(rows[first][lane], kept | low(u128::from(moved), width), "{what}");
            assert_eq!(rows[first + 1][lane], field, "{what}");
            assert_eq!(rows[first + 2][lane], low(u128::from(sign), width), "{what}");
        }
        assert_eq!(rows[9][lane], u64::from(base.count_ones()));
        assert_eq!(rows[10][lane], base.reverse_bits());
        assert_eq!(rows[11][lane], u64::from((base as u16).reverse_bits()));
        let scaled = 1.5 * (exponent.cast_signed().clamp(-1000, 1000) as f64).exp2();
        let found = f32::from_bits(rows[12][lane] as u32);
        assert_eq!(found, scaled as f32, "exponent {}", exponent.cast_signed());
    }
}

#[gaurast_runner::test]
fn constructs_are_left_early() {
    let results = run("exits.comp", &[], 4 * LANES);
    let row = |index: usize| &results[LANES * index..][..LANES];
    for at in 0..LANES as u32 {
        let (is_odd, has_two) = (at & 1 != 0, at & 2 != 0);
        let lane = at as usize;
        let both = if has_two { 20 } else { 10 } + u32::from(is_odd);
        assert_eq!(row(0)[lane], both, "lane {at}");
        let inner = match (is_odd, has_two) {
            (false, _) => 3,
            (true, true) => 100 + 4,
            (true, false) => 41 + 5,
        };
        assert_eq!(row(1)[lane], inner, "lane {at}");
        let (mut sum, mut turn) = (0, 0);
        let last = loop {
            let goes_on = match (turn + at) & 7 {
                0 => {
                    sum += 110;
                    true
                }
                1 => {
                    sum += 100;
                    true
                }
                2 => false,
                3 => break turn,
                _ => is_odd,
            };
            sum += u32::from(goes_on);
            turn += 1;
            if turn >= 5 {
                break turn;
            }
        };
        assert_eq!(row(2)[lane], sum + last * 40_000, "lane {at}");
        assert_eq!(row(3)[lane], if has_two { 4 } else { 3 }, "lane {at}");
    }
}

#[gaurast_runner::test]
fn code_that_never_runs_may_be_wrong() {
    let results = run("never_run.comp", &[], 2 * LANES);
    assert_eq!(results, [1; 2 * LANES]);
}

#[gaurast_runner::test]
fn pointers_are_chosen_at_run_time() {
    let first: Vec<u32> = (0..80).map(|index| 1000 + 7 * index).collect();
    let second: Vec<u32> = (0..80).map(|index| 50_000 + 11 * index).collect();
    // Two matrices of two columns, 16 bytes apart.
    let matrices: Vec<u32> = (0..16).map(|index| (index as f32).to_bits()).collect();
    let shader = translated("variable_pointers.comp", &Specialization::default());
    let (first_buffer, second_buffer) = (buffer(&first), buffer(&second));
    let results = buffer(&[0; 8 * LANES]);
    Dispatch {
        buffers: &[
            ((0, 0, 0), &first_buffer),
            ((0, 1, 0), &second_buffer),
            ((0, 2, 0), &results),
            ((0, 3, 0), &buffer(&matrices)),
        ],
        ..Dispatch::new(&shader, [1, 1, 1])
    }
    .run()
    .unwrap();
    let results = contents(&results);
    let row = |index: usize| &results[LANES * index..][..LANES];
    for at in 0..LANES {
        let is_odd = at % 2 == 1;
        let chosen = if is_odd { &first } else { &second };
        assert_eq!(row(0)[at], chosen[at + 2], "moved, lane {at}");
        assert_eq!(row(1)[at], chosen[at], "returned, lane {at}");
        assert_eq!(row(2)[at], chosen[at..at + 3].iter().sum::<u32>(), "lane {at}");
        assert_eq!(row(3)[at], if is_odd { 65 } else { 0 }, "compared, lane {at}");
        assert_eq!(row(4)[at], 2, "distance, lane {at}");
        let shared = if is_odd { at } else { 128 * at };
        assert_eq!(row(5)[at], shared as u32, "workgroup memory, lane {at}");
        let stored = if is_odd { second[at] } else { at as u32 };
        assert_eq!(row(6)[at], stored, "stored, lane {at}");
        let corners = if is_odd { 12 + 13 } else { 4 + 5 };
        assert_eq!(row(7)[at], corners, "matrix, lane {at}");
    }
    // A pointer may point to any of them.
    let writable = shader.interface.descriptors.iter().map(|it| it.writable);
    assert!(writable.eq([true; 4]));
}

/// Steps back by constants, distances of elements whose stride only the array's type has, and comparisons of pointers to
/// matrices of two layouts.
#[gaurast_runner::test]
fn pointers_move_back() {
    let source: Vec<u32> = (0..80).map(|index| 1000 + 7 * index).collect();
    let results = run("pointers_back.comp", &[&buffer(&source)], 5 * LANES);
    let row = |index: usize| &results[LANES * index..][..LANES];
    for at in 0..LANES {
        assert_eq!(row(0)[at], source[at + 2], "before the fourth, lane {at}");
        assert_eq!(row(1)[at], source[at + 1], "kept, lane {at}");
        assert_eq!(row(2)[at].cast_signed(), -2, "distance, lane {at}");
        assert_eq!(row(3)[at], at as u32, "rows, lane {at}");
        assert_eq!(row(4)[at], 2, "matrices, lane {at}");
    }
}

/// Copies between layouts, choices of whole structs, narrowed constants, loop controls, copies with two memory operands,
/// variables that nothing writes, and decorations by strings.
#[gaurast_runner::test]
fn additions_of_1_4_are_translated() {
    let source: Vec<u32> = (0..16 * LANES as u32).map(|word| 1000 + word).collect();
    let results = run("spirv_1_4.comp", &[&buffer(&source)], 6 * LANES);
    let row = |index: usize| &results[LANES * index..][..LANES];
    for at in 0..LANES {
        let is_odd = at % 2 == 1;
        let element = |pair: usize, index: usize| source[16 * pair + 4 + 4 * index];
        assert_eq!(row(0)[at], source[16 * at] + element(at, at % 3), "copied, lane {at}");
        let chosen = if is_odd { at } else { 0 };
        assert_eq!(row(1)[at], element(chosen, 2), "chosen, lane {at}");
        assert_eq!(row(2)[at], 70_001 & 0xffff, "narrowed, lane {at}");
        assert_eq!(row(3)[at], if is_odd { 28 } else { 6 }, "looped, lane {at}");
        assert_eq!(row(4)[at], element(at, 2), "copied in memory, lane {at}");
        let low = at as u32 % 4;
        assert_eq!(row(5)[at], (low + 2).pow(2) * (low + 1), "looked up, lane {at}");
    }
}

#[gaurast_runner::test]
fn older_subgroup_operations_are_the_newer_ones() {
    const SIZE: u32 = crate::common::OPTIONS.subgroup_size;
    let results = run("subgroups_khr.comp", &[], 6 * LANES);
    let row = |index: usize| &results[LANES * index..][..LANES];
    for at in 0..LANES as u32 {
        let (lane, own, first) = (at as usize, at % SIZE, at / SIZE * SIZE);
        assert_eq!(row(0)[lane], 0xaaaa, "ballot, lane {at}");
        assert_eq!(row(1)[lane], first + 64 * (first + 3), "moved, lane {at}");
        assert_eq!(row(2)[lane], if first == 0 { 2 } else { 6 }, "voted, lane {at}");
        assert_eq!(row(3)[lane], own + 64 * SIZE, "numbered, lane {at}");
        assert_eq!(row(4)[lane], 1 << own, "equal, lane {at}");
        assert_eq!(row(5)[lane], (1 << own) - 1, "below, lane {at}");
    }
}

#[gaurast_runner::test]
fn blocks_of_shared_memory_lie_in_one_place() {
    let results = run("shared_blocks.comp", &[], 3 * LANES);
    let word = |index: usize| 0x10203 * (index as u32 + 1);
    for lane in 0..LANES {
        assert_eq!(results[lane], word((lane + 1).min(63)) >> 16, "lane {lane}");
        assert_eq!(results[LANES + lane], word(lane) >> 8 & 0xff, "lane {lane}");
        let replaced = word(lane) & 0xff_ffff | (lane as u32) << 24;
        assert_eq!(results[2 * LANES + lane], replaced, "lane {lane}");
    }
}

#[gaurast_runner::test]
fn dot_products_of_integers() {
    let mut random = Random(79);
    let mut operands: Vec<u32> = (0..3 * LANES).map(|_| random.next()).collect();
    let extremes = [0, u32::MAX, 0x8080_8080, 0x7f7f_7f7f, 0x8000_8000];
    operands[..5].copy_from_slice(&extremes);
    operands[LANES..LANES + 5].copy_from_slice(&extremes);
    let limits = [i32::MAX, i32::MIN, -1, i32::MAX - 2, i32::MIN + 9].map(i32::cast_unsigned);
    operands[2 * LANES..2 * LANES + 5].copy_from_slice(&limits);
    let results = run("integer_dot.comp", &[&buffer(&operands)], 9 * LANES);
    for lane in 0..LANES {
        let [a, b, c] = [0, 1, 2].map(|index| operands[LANES * index + lane]);
        let [sa, sb, sc] = [a, b, c].map(|word| i64::from(word.cast_signed()));
        let unsigned = |word: u32| word.to_le_bytes().map(i64::from);
        let signed = |word: u32| word.to_le_bytes().map(|byte| i64::from(byte.cast_signed()));
        let shorts = |word: u32| [i64::from(word as i16), i64::from((word >> 16) as i16)];
        let dot = |a: &[i64], b: &[i64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<i64>();
        let int = |value: i64| value.clamp(i32::MIN.into(), i32::MAX.into()) as u32;
        let mixed = dot(&signed(a), &unsigned(b));
        let products = sa.wrapping_mul(sb).wrapping_add(sb.wrapping_mul(sc));
        let square = dot(&signed(a), &signed(a)) + i64::from(c as i16);
        let expected = [
            dot(&signed(a), &signed(b)) as u32,
            dot(&unsigned(a), &unsigned(b)) as u32,
            mixed as u32,
            mixed as u32,
            int(dot(&signed(a), &signed(b)) + sc),
            (dot(&unsigned(a), &unsigned(b)) + i64::from(c)).min(u32::MAX.into()) as u32,
            int(dot(&shorts(a), &shorts(b)) + sc),
            products as u32,
            square.clamp(i16::MIN.into(), i16::MAX.into()) as u32,
        ];
        for (row, expected) in expected.into_iter().enumerate() {
            let found = results[LANES * row + lane];
            assert_eq!(found, expected, "row {row}: {a:#x} {b:#x} {c:#x}");
        }
    }
}

/// A module's words with one more declaration of a capability.
fn with(words: &[u32], capability: spirv::Capability) -> Vec<u32> {
    let (header, rest) = words.split_at(5);
    [header, &[2 << 16 | spirv::Op::Capability as u32, capability as u32], rest].concat()
}

/// A module's words without the declarations of a capability.
fn without(words: &[u32], capability: spirv::Capability) -> Vec<u32> {
    let declaration = [2 << 16 | spirv::Op::Capability as u32, capability as u32];
    rewritten(words, |instruction| if instruction == declaration { Vec::new() } else { instruction.to_vec() })
}

#[gaurast_runner::test]
fn descriptor_arrays_without_a_length_need_their_capability() {
    let words = words_of("unsized_descriptors.comp");
    let attempt = |words: &[u32]| {
        let module = Module::parse(words).unwrap();
        let specialization = Specialization::default();
        let options = gaurast_spirv::Options { unsized_descriptors: 5, ..crate::common::OPTIONS };
        let stage = gaurast_spirv::Stage::Compute;
        gaurast_spirv::translate(&module, "main", stage, &specialization, &options)
    };
    let shader = attempt(&words).unwrap();
    let counts: Vec<(u32, bool)> = shader.interface.descriptors.iter().map(|it| (it.count, it.is_unsized)).collect();
    assert_eq!(counts, [(5, true), (1, false)]);
    let lacking = without(&words, spirv::Capability::RuntimeDescriptorArray);
    assert_ne!(lacking, words);
    let refused = attempt(&lacking).unwrap_err().to_string();
    assert!(refused.contains("needs RuntimeDescriptorArray"), "{refused}");
}

/// Tests the capabilities of Vulkan 1.3 that need no feature.
#[gaurast_runner::test]
fn capabilities_that_need_no_feature_are_accepted() {
    use spirv::Capability as C;
    let words = words_of("descriptor_arrays.comp");
    for capability in [
        C::Matrix,
        C::Shader,
        C::InputAttachment,
        C::Sampled1D,
        C::Image1D,
        C::SampledBuffer,
        C::ImageBuffer,
        C::ImageQuery,
        C::DerivativeControl,
        C::StorageImageExtendedFormats,
        C::StorageImageReadWithoutFormat,
        C::StorageImageWriteWithoutFormat,
        C::DeviceGroup,
        C::ShaderNonUniform,
    ] {
        let module = Module::parse(&with(&words, capability)).unwrap();
        let translated = gaurast_spirv::translate(
            &module,
            "main",
            gaurast_spirv::Stage::Compute,
            &Specialization::default(),
            &crate::common::OPTIONS,
        );
        assert!(translated.is_ok(), "{capability:?}: {:?}", translated.err());
    }
}

#[gaurast_runner::test]
fn private_variables_begin_as_pointers_to_other_variables() {
    let found = run("pointer_initializers.comp", &[], LANES);
    for (lane, found) in found.iter().enumerate() {
        let other = (LANES - 1 - lane) as u32;
        assert_eq!(*found, other + other * other, "lane {lane}");
    }
}

#[gaurast_runner::test]
fn constants_are_quantized_as_running_values_are() {
    // Halves, binary16's greatest denormal and least normal number, and numbers that round up to the latter or overflow.
    for bits in [0x3f00_0000, 0x387f_c000, 0xb87f_c000, 0x3880_0000, 0xb87f_ffff, 0x3300_0000, 0x477f_f000, 0xff80_0000]
    {
        let mut specialization = Specialization::default();
        specialization.set(0, &u32::to_le_bytes(bits));
        let shader = translated("quantized_constants.comp", &specialization);
        let results = buffer(&[0xdead_beef; 2 * LANES]);
        Dispatch { buffers: &[((0, 0, 0), &results)], ..Dispatch::new(&shader, [1, 1, 1]) }.run().unwrap();
        let value = f32::from_bits(bits);
        let rounded = half::f16::from_f32(value).to_f32();
        let is_denormal = rounded.abs() < 2.0_f32.powi(-14);
        let expected = if is_denormal { 0.0_f32.copysign(value) } else { rounded };
        assert_eq!(contents(&results), [expected.to_bits(); 2 * LANES], "{value}");
    }
}

/// Zeros are ordered by their signs where a module says which operations may ignore these.
#[gaurast_runner::test]
fn zeros_have_signs() {
    let values = [0.0, -0.0, 1.0, -1.0, f32::INFINITY, f32::NEG_INFINITY, 2.5, -2.5];
    let pairs: Vec<(f32, f32)> = (0..LANES).map(|lane| (values[lane / 8], values[lane % 8])).collect();
    let first = floats(&pairs.iter().map(|pair| pair.0).collect::<Vec<_>>());
    let second = floats(&pairs.iter().map(|pair| pair.1).collect::<Vec<_>>());
    let module = Module::parse(&with(&words_of("signed_zeros.comp"), spirv::Capability::FloatControls2)).unwrap();
    let (stage, specialization) = (gaurast_spirv::Stage::Compute, Specialization::default());
    let shader = gaurast_spirv::translate(&module, "main", stage, &specialization, &crate::common::OPTIONS).unwrap();
    let results = buffer(&[0xdead_beef; 3 * LANES]);
    let buffers = [((0, 0, 0), &first), ((0, 1, 0), &second), ((0, 2, 0), &results)];
    Dispatch { buffers: &buffers, ..Dispatch::new(&shader, [1, 1, 1]) }.run().unwrap();
    let results = contents(&results);
    for (lane, (a, b)) in pairs.into_iter().enumerate() {
        let is_first_less = a.total_cmp(&b).is_lt();
        let fraction = if a.is_infinite() { 0.0_f32 } else { a.fract() }.copysign(a);
        let expected = if is_first_less { [a, b, fraction] } else { [b, a, fraction] };
        for (row, expected) in expected.into_iter().enumerate() {
            let found = f32::from_bits(results[LANES * row + lane]);
            assert_eq!(found.to_bits(), expected.to_bits(), "row {row} of {a} and {b}: {found}, not {expected}");
        }
    }
}
