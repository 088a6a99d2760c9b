//! PSNR and SSIM of 20 pairs of pictures against values that `metrics.py` has computed as other programs do.

#![cfg(feature = "metrics")]

use gaurast_picture::{Ssim, Statistics};

/// The greatest difference of a measure.
const TOLERANCE: f64 = 1e-6;

/// A pair of pictures of bytes. A linear congruential generator makes their noise.
fn pair(index: u32) -> (Vec<[f32; 4]>, Vec<[f32; 4]>, u32) {
    let (width, height) = (16 + 7 * index, 12 + 5 * index);
    let mut state = index + 1;
    let (mut a, mut b) = (Vec::new(), Vec::new());
    for at in 0..width * height {
        let (x, y) = (at % width, at / width);
        let (mut first, mut second) = ([1.0; 4], [1.0; 4]);
        for c in 0..3 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let noise = (state >> 24) as i32 - 128;
            let value = ((x * (5 + c) + y * (3 + index) + x * y / 16) % 256) as i32;
            let noisy = (value + (noise * (index as i32 + 1)).div_euclid(32)).clamp(0, 255);
            (first[c as usize], second[c as usize]) = (value as f32 / 255.0, noisy as f32 / 255.0);
        }
        a.push(first);
        b.push(second);
    }
    (a, b, width)
}

#[test]
fn measures_are_those_of_other_programs() {
    for (index, [psnr, ssim, ssim_torchmetrics, ssim_valid]) in (0..).zip(EXPECTED) {
        let (a, b, width) = pair(index);
        let (statistics, found) = (Statistics::new(&a, &b, width), Ssim::new(&a, &b, width));
        let (torchmetrics, valid) = (found.torchmetrics.expect("wide"), found.valid.expect("a window fits"));
        assert!((statistics.psnr - psnr).abs() < TOLERANCE, "{index}: {} {psnr}", statistics.psnr);
        assert!((found.inria - ssim).abs() < TOLERANCE, "{index}: {found:?} {ssim}");
        assert!((torchmetrics - ssim_torchmetrics).abs() < TOLERANCE, "{index}: {found:?} {ssim_torchmetrics}");
        assert!((valid - ssim_valid).abs() < TOLERANCE, "{index}: {found:?} {ssim_valid}");
    }
}

/// Two flat pictures, whose measures have a closed form: SSIM is (2xy + C1) / (x^2 + y^2 + C1) wherever the window lies in
/// the picture, and PSNR is -20 log10 |x - y|.
#[test]
fn flat_pictures_have_a_closed_form() {
    let (x, y) = (0.25_f32, 0.75);
    let flat = |value: f32| vec![[value, value, value, 1.0]; 40 * 30];
    let (a, b) = (flat(x), flat(y));
    let c1 = 1e-4;
    let expected = (2.0 * 0.25 * 0.75 + c1) / (0.25 * 0.25 + 0.75 * 0.75 + c1);
    let found = Ssim::new(&a, &b, 40);
    for ssim in [found.torchmetrics, found.valid] {
        let ssim = ssim.expect("a window fits");
        assert!((ssim - expected).abs() < 1e-12, "{ssim} {expected}");
    }
    let psnr = Statistics::new(&a, &b, 40).psnr;
    assert!((psnr - 20.0 * 2.0_f64.log10()).abs() < 1e-12, "{psnr}");
}

/// PSNR, and SSIM as 3DGS, torchmetrics and pytorch-msssim compute it, of each pair.
const EXPECTED: [[f64; 4]; 20] = [
    [40.982676217, 0.991241801, 0.979523660, 0.983784713],
    [34.808055273, 0.967073685, 0.936019407, 0.939969063],
    [31.391430093, 0.942013142, 0.903910495, 0.904875769],
    [28.945228587, 0.921663440, 0.876543576, 0.897440240],
    [27.019466249, 0.901169706, 0.856474993, 0.876524089],
    [25.464567785, 0.879147595, 0.837437763, 0.854593595],
    [24.197141037, 0.862466637, 0.823909903, 0.837378913],
    [23.057033242, 0.848696025, 0.812018771, 0.828092759],
    [22.123867435, 0.839405888, 0.805891242, 0.820462271],
    [21.169018281, 0.829405812, 0.798786579, 0.811953340],
    [20.398178100, 0.821948394, 0.795633236, 0.806112611],
    [19.668788950, 0.815008174, 0.789928094, 0.801077783],
    [19.057890070, 0.810910477, 0.788561959, 0.798101232],
    [18.447251492, 0.803867240, 0.783481605, 0.791376089],
    [17.856386019, 0.797648765, 0.778736283, 0.787116846],
    [17.366354484, 0.793927544, 0.777029006, 0.784207422],
    [16.872155415, 0.789019616, 0.772734543, 0.780559173],
    [16.422055873, 0.782356795, 0.767388204, 0.774436438],
    [15.996539850, 0.777645001, 0.763855791, 0.770080514],
    [15.595526715, 0.771773826, 0.759048172, 0.764266178],
];
