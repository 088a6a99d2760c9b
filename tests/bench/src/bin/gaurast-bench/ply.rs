//! Writes scenes as binary PLY files of 3DGS, for measurements of reading.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use gaurast_scene::Scene;

/// Writes a scene.
///
/// # Errors
/// If the file cannot be written.
pub(super) fn write(path: &Path, scene: &Scene) -> std::io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    let stride = scene.sh_stride();
    write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}\n", scene.len())?;
    let rest = (0..3 * (stride - 1)).map(|number| format!("f_rest_{number}"));
    let names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2"].map(str::to_owned);
    let others = ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"].map(str::to_owned);
    for name in names.into_iter().chain(rest).chain(others) {
        writeln!(out, "property float {name}")?;
    }
    out.write_all(b"end_header\n")?;
    let mut floats: Vec<f32> = Vec::new();
    let harmonics = scene.sh().chunks_exact(stride);
    for ((position, shape), harmonics) in scene.positions().iter().zip(scene.shapes()).zip(harmonics) {
        floats.clear();
        floats.extend(position);
        floats.extend(harmonics[0]);
        // The coefficients of red come first, then those of green and blue.
        for channel in 0..3 {
            floats.extend(harmonics[1..].iter().map(|triple| triple[channel]));
        }
        let opacity = f64::from(shape.opacity).clamp(1e-9, 1.0 - 1e-7);
        floats.push((opacity / (1.0 - opacity)).ln() as f32);
        floats.extend(shape.scale.map(f32::ln));
        floats.extend(shape.rotation);
        out.write_all(bytemuck::cast_slice(&floats))?;
    }
    out.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_are_read_as_they_were_written() {
        let scene = gaurast_oracle::scenes::synthetic(3, 40);
        let file = tempfile::Builder::new().suffix(".ply").tempfile().unwrap();
        write(file.path(), &scene).unwrap();
        let read = gaurast_scene::open(file.path()).unwrap();
        assert_eq!(read.positions(), scene.positions());
        assert_eq!(read.sh(), scene.sh());
        for (one, other) in read.shapes().iter().zip(scene.shapes()) {
            let near = |a: f32, b: f32| (a - b).abs() <= 1e-5 * a.abs().max(b.abs());
            assert!(near(one.opacity, other.opacity));
            assert!((0..3).all(|axis| near(one.scale[axis], other.scale[axis])));
        }
    }
}
