//! Compares the instructions of a frame with stored ones.

use std::path::Path;
use std::process::{Command, Stdio};

use super::error::{CountsError, Obstacle};
use super::pictures;
use super::report::Report;
use super::stored::{Table, percent};
use super::workload::{WORKER, Workload};
use crate::callgrind::{self, LEVEL};
use crate::output::Rows;
use crate::worker::OPTIMIZATIONS;

/// The percentage by which a count may differ from the stored one.
const TOLERANCE: f64 = 1.0;

/// The number of the counted frame. The first frame is cold, and the second one builds chunks of Gaussians.
const FRAMES: u32 = 3;

/// The first obstacle to counting, if there is one.
pub(super) fn obstacle() -> Option<Obstacle> {
    let valgrind = Command::new("valgrind").arg("--version").stdout(Stdio::null()).status();
    if !valgrind.is_ok_and(|status| status.success()) {
        return Some(Obstacle::NoValgrind);
    }
    (!pictures::is_there(LEVEL)).then_some(Obstacle::NoAvx2)
}

/// The first obstacle to counting through the Vulkan loader, if there is one.
pub(super) fn obstacle_to_the_loader() -> Option<Obstacle> {
    // SAFETY: the system's loader is sound.
    let loader = unsafe { ash::Entry::load() };
    obstacle().or_else(|| loader.is_err().then_some(Obstacle::NoLoader))
}

/// Compares the instructions of every workload's frame with the stored ones, or stores them. Each is counted `runs`
/// times; the median counts.
pub(super) fn check(report: &mut Report, runs: u32, store: bool) -> Result<(), CountsError> {
    let mut table = Table::load(
        "instructions.csv",
        "Instructions of a warm frame at AVX2 on one thread, profiling profile; the spread of runs in percent. Written by gaurast-bench counts --store.",
        &["workload", "instructions", "spread"],
        1,
    )?;
    let mut rows = Rows::new(&["workload", "instructions", "stored", "change", "spread"]);
    for workload in Workload::stored() {
        let mut counts = (0..runs).map(|_| count(workload, None)).collect::<Result<Vec<_>, _>>()?;
        counts.sort_unstable();
        let (count, name) = (counts[counts.len() / 2], workload.name());
        let spread = match runs {
            1 => "-".to_owned(),
            _ => format!("{:.4}", percent(counts[counts.len() - 1], counts[0])),
        };
        let stored: Option<u64> = (table.get(&[&name])).and_then(|cells| cells[0].parse().ok());
        let change = stored.map(|stored| percent(count, stored));
        rows.rows.push(vec![
            name.clone(),
            count.to_string(),
            stored.map_or("-".to_owned(), |stored| stored.to_string()),
            change.map_or("-".to_owned(), |change| format!("{change:+.2} %")),
            spread.clone(),
        ]);
        if store {
            table.set(&[&name], &[&count.to_string(), &spread]);
            continue;
        }
        match change {
            None => report.fail(format!("{name}: no count is stored")),
            Some(change) if change > TOLERANCE => report.fail(format!(
                "{name}: {change:.2} % more instructions than stored: find out why, or store the new count"
            )),
            Some(change) if change < -TOLERANCE => report.fail(format!(
                "{name}: {:.2} % fewer instructions than stored: store the new count, so that it stays so",
                -change
            )),
            Some(_) => {}
        }
    }
    println!("{}", rows.table());
    if store {
        table.store()?;
    }
    Ok(())
}

/// Compares the instructions of a Gaussian frame through the Vulkan loader with those of the embedded driver.
/// `manifest` is the path of the driver's JSON manifest.
pub(super) fn compare_loader(report: &mut Report, manifest: &Path) -> Result<(), CountsError> {
    let workload = Workload::GaussiansSynthetic;
    let embedded = count(workload, None)?;
    let loaded = count(workload, Some(manifest))?;
    let ratio = loaded as f64 / embedded as f64;
    println!("embedded {embedded}, through the loader {loaded} instructions: ratio {ratio:.4}");
    if (100.0 * (ratio - 1.0)).abs() > TOLERANCE {
        report.fail(format!(
            "through the loader, a frame takes {ratio:.4} times the instructions of the embedded driver's"
        ));
    }
    Ok(())
}

/// The instructions of a workload's last frame, embedded or through the loader with the driver of `manifest`. It is the
/// difference of two processes: one draws the frame, and the other stops before it.
fn count(workload: Workload, manifest: Option<&Path>) -> Result<u64, CountsError> {
    let all = process(workload, FRAMES, manifest)?;
    Ok(all.saturating_sub(process(workload, FRAMES - 1, manifest)?))
}

/// The instructions of a process that draws `frames` frames of a workload.
fn process(workload: Workload, frames: u32, manifest: Option<&Path>) -> Result<u64, CountsError> {
    let (frames, name) = (frames.to_string(), workload.name());
    let mut arguments = vec![WORKER, "--frames", &frames, &name];
    let mut environment = vec![("GAURAST_OPTIMIZATIONS", OPTIMIZATIONS)];
    let manifest = manifest.map(Path::canonicalize).transpose()?;
    let manifest = manifest.map(|path| path.to_string_lossy().into_owned());
    if let Some(manifest) = &manifest {
        arguments.push("--through-the-loader");
        environment.extend([("VK_DRIVER_FILES", &**manifest), ("VK_ICD_FILENAMES", manifest)]);
    }
    Ok(callgrind::count(&arguments, &environment, &[])?.instructions)
}
