//! `.ksplat` files.

use gaurast_runner::data;
use gaurast_scene::{Place, Reason};
use half::f16;

use super::support::*;

/// A file of three Gaussians of degree 2 at compression level `level`: a section of two buckets, a full one with two of
/// them.
pub fn file(level: u16) -> Vec<u8> {
    let mut header = vec![0; 4096 + 1024];
    header[1] = 1;
    let mut put = |at: usize, bytes: &[u8]| header[at..at + bytes.len()].copy_from_slice(bytes);
    put(4, &1_u32.to_le_bytes());
    put(8, &1_u32.to_le_bytes());
    put(12, &3_u32.to_le_bytes());
    put(16, &3_u32.to_le_bytes());
    put(20, &level.to_le_bytes());
    put(36, &(-2_f32).to_le_bytes());
    put(40, &2_f32.to_le_bytes());
    let section = [(0, 3_u32), (4, 3), (8, 2), (12, 2), (24, 0), (32, 1), (36, 1)];
    for (at, value) in section {
        put(4096 + at, &value.to_le_bytes());
    }
    put(4096 + 16, &5_f32.to_le_bytes());
    put(4096 + 20, &12_u16.to_le_bytes());
    put(4096 + 40, &2_u16.to_le_bytes());
    let mut file = header;
    file.extend(1_u32.to_le_bytes());
    for centre in [1.0_f32, 2.0, 3.0, -1.0, -2.0, -3.0] {
        file.extend(centre.to_le_bytes());
    }
    for i in 0..3 {
        let number = |file: &mut Vec<u8>, value: f32| {
            if level == 0 {
                file.extend(value.to_le_bytes());
            } else {
                file.extend(f16::from_f32(value).to_le_bytes());
            }
        };
        for axis in 0..3_u16 {
            if level == 0 {
                file.extend((f32::from(i) + f32::from(axis)).to_le_bytes());
            } else {
                // 32767 is the centre.
                file.extend((32767 + 100 * i - 1000 * axis).to_le_bytes());
            }
        }
        for value in [0.5, 0.25, 0.125, 0.5, -0.5, 0.5, 0.5] {
            number(&mut file, value);
        }
        file.extend([0, 51, 255, 102]);
        for k in 0..24_u8 {
            if level == 2 {
                file.push(10 * k);
            } else {
                number(&mut file, f32::from(k) / 16.0);
            }
        }
    }
    file
}

#[gaurast_runner::test]
fn ksplat_values_at_every_level() {
    for level in 0..=2 {
        let scene = read("a.ksplat", &file(level)).expect("a good file");
        assert_eq!((scene.len(), scene.sh_degree()), (3, 2));
        for i in 0..3 {
            let f = i as f32;
            let expected = if level == 0 {
                [f, f + 1.0, f + 2.0]
            } else {
                // The third is in the second bucket.
                let sign = if i == 2 { -1.0 } else { 1.0 };
                [0.0, 1.0, 2.0].map(|axis: f32| sign * (axis + 1.0) + (100.0 * f - 1000.0 * axis) * 2.5 / 32767.0)
            };
            close(&scene.positions()[i], &expected, 1e-5);
            let shape = scene.shapes()[i];
            assert_eq!(shape.scale, [0.5, 0.25, 0.125]);
            assert_eq!(shape.rotation, [0.5, -0.5, 0.5, 0.5]);
            assert_eq!(shape.opacity, 0.4);
            let sh = &scene.sh()[9 * i..9 * (i + 1)];
            close(&sh[0].map(|c| 0.5 + SH_C0 * c), &[0.0, 0.2, 1.0], 1e-6);
            let value = |k: usize| match level {
                2 => -2.0 + 4.0 * (10 * k) as f32 / 255.0,
                _ => k as f32 / 16.0,
            };
            // Degree by degree, channel by channel.
            for k in 0..3 {
                close(&sh[1 + k], &[value(k), value(3 + k), value(6 + k)], 1e-6);
            }
            for k in 0..5 {
                close(&sh[4 + k], &[value(9 + k), value(14 + k), value(19 + k)], 1e-6);
            }
        }
    }
}

#[gaurast_runner::test]
fn malformed_ksplat_is_refused_with_place_and_reason() {
    let refused = |at: usize, bytes: &[u8]| {
        let mut file = file(1);
        file[at..at + bytes.len()].copy_from_slice(bytes);
        refusal("a.ksplat", &file)
    };
    let huge = u32::MAX.to_le_bytes();
    let (place, reason) = refused(0, &[1]);
    assert_eq!(place, Place::Header("version"));
    assert!(matches!(reason, Reason::Unsupported(_)));
    assert!(matches!(refused(20, &[3]).1, Reason::Range { found: 3, .. }));
    assert!(matches!(refused(4, &huge).1, Reason::TooShort { .. }));
    assert!(matches!(refused(16, &[4]).1, Reason::Count { found: 3, expected: 4 }));
    assert!(matches!(refused(4096, &huge).1, Reason::Count { .. }));
    for at in [12, 36] {
        assert!(matches!(refused(4096 + at, &huge).1, Reason::TooShort { .. }));
    }
    assert!(matches!(refused(4096 + 40, &[4]).1, Reason::Range { found: 4, .. }));
    // Buckets whose capacity is less than the number of records.
    assert!(matches!(refused(4096 + 8, &[1]).1, Reason::Count { found: 2, expected: 3 }));
    assert!(matches!(refusal("a.ksplat", &[0, 1]).1, Reason::TooShort { .. }));
}

#[gaurast_runner::test]
fn the_small_ksplat_is_read() {
    let scene = gaurast_scene::open(data("formats/minimal.ksplat")).expect("a good file");
    assert_eq!((scene.len(), scene.sh_degree()), (4, 0));
    assert!(scene.shapes().iter().all(|shape| shape.opacity > 0.0));
}
