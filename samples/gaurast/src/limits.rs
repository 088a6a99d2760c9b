//! Checks of requests that would take too much memory.

use std::fs;

use gaurast_scene::Camera;

/// Checks that there is memory for pictures of this camera's size: on the device, on the host, and for the file.
///
/// # Errors
/// A sentence about the limit.
pub fn check_memory(camera: &Camera, depth: bool, encoding: u64, views: usize) -> Result<(), String> {
    let Some(available) = available_memory() else {
        return Ok(());
    };
    let pixel = 16 + if depth { 8 } else { 0 };
    // The attachment, the buffer that the host reads, and pictures: one is drawn while another is written.
    let pictures = if views > 1 { 2 } else { 1 };
    let needed = u64::from(camera.width) * u64::from(camera.height) * ((2 + pictures) * pixel + encoding);
    if needed > available {
        let gibibytes = |bytes: u64| bytes as f64 / (1_u64 << 30) as f64;
        return Err(format!(
            "a picture of {}x{} pixels takes {:.1} GiB of memory, and {:.1} are free: a smaller --size fits",
            camera.width,
            camera.height,
            gibibytes(needed),
            gibibytes(available),
        ));
    }
    Ok(())
}

/// The available memory in bytes, as far as Linux reports it: the machine's, or less if the process's control group is
/// limited.
fn available_memory() -> Option<u64> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let machine = line.trim().strip_suffix(" kB")?.trim().parse::<u64>().ok()? * 1024;
    let number = |file: &str| fs::read_to_string(file).ok()?.trim().parse::<u64>().ok();
    let group = number("/sys/fs/cgroup/memory.max")
        .zip(number("/sys/fs/cgroup/memory.current"))
        .map(|(most, used)| most.saturating_sub(used));
    Some(group.map_or(machine, |group| group.min(machine)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn what_cannot_fit_is_refused() {
        let mut camera = gaurast_scene::garden::camera(None, [64, 48]).expect("a camera");
        assert_eq!(check_memory(&camera, false, 8, 1), Ok(()));
        [camera.width, camera.height] = [1 << 20, 1 << 20];
        let refused = check_memory(&camera, false, 8, 1).expect_err("48 TiB");
        assert!(refused.contains("1048576x1048576") && refused.contains("GiB"), "{refused}");
    }
}
