//! PLY files as 3DGS writes them, as text.

use std::fmt::Write;

use crate::gaussian::Gaussian;

/// The file of Gaussians of degree 0: logarithms of scales, logits of opacities.
pub fn ply(gaussians: &[Gaussian]) -> Vec<u8> {
    let mut text = format!("ply\nformat ascii 1.0\ncomment CC0\nelement vertex {}\n", gaussians.len());
    let names = "x y z scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3 opacity f_dc_0 f_dc_1 f_dc_2";
    for name in names.split(' ') {
        writeln!(text, "property float {name}").expect("memory");
    }
    text += "end_header\n";
    for one in gaussians {
        let [x, y, z, w] = one.rotation;
        let logit = libm::log(f64::from(one.opacity) / (1.0 - f64::from(one.opacity))) as f32;
        let mut numbers = one.position.to_vec();
        numbers.extend(one.scale.map(|scale| libm::log(f64::from(scale)) as f32));
        numbers.extend([w, x, y, z, logit]);
        numbers.extend(one.harmonics[0]);
        let numbers: Vec<String> = numbers.iter().map(f32::to_string).collect();
        writeln!(text, "{}", numbers.join(" ")).expect("memory");
    }
    text.into_bytes()
}
