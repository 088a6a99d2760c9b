//! `gaurast eval`: a trained model against its photographs.

mod arguments;
mod dataset;
mod error;
mod gsplat_world;
mod report;
mod split;

use std::io::Write;
use std::sync::mpsc::sync_channel;

use clap::ValueEnum;
use gaurast_picture::{Picture, resized};

use crate::args::{CameraArguments, SceneArguments};
use crate::cameras::{self, Known, Views};
use crate::drawing::{self, DrawError, Drawing};
use crate::limits;
use crate::measures::{Measures, difference, in_eight_bits, shown};
use crate::progress::Progress;
use crate::sources::Source;
pub use arguments::EvalArguments;
use arguments::Values;
use dataset::{Dataset, Exposure, Measured};
pub use error::Error;
use gsplat_world::Chosen;
use report::{Outcome, Report, Results};

/// Draws the views, measures them, and prints the results.
pub fn run(arguments: &EvalArguments) -> Result<(), Error> {
    let quiet = arguments.quiet || arguments.json;
    let progress = Progress { quiet };
    let source = Source::of(&SceneArguments { scenes: vec![arguments.model.clone()], ..SceneArguments::default() })?;
    let mut dataset = dataset::find(arguments, &source)?;
    let (scene, _) = source.load(progress)?;
    if let Some(worlds) = &dataset.worlds {
        let Chosen { world, share, next } = worlds.choose(scene.positions());
        for measured in &mut dataset.views {
            measured.view.camera = world.camera(&measured.view.camera);
        }
        let choice = format!(
            "gsplat's, in the orientation in which {:.1} % of COLMAP's points lie near Gaussians, of four; the next has {:.1} %",
            100.0 * share,
            100.0 * next
        );
        dataset.choices.insert("world", choice);
    }
    dataset.notes.extend(drawing::notes(&arguments.modes, &scene, scene.sh_degree()));
    let drawn = match arguments.modes.renderer.and_then(|renderer| renderer.to_possible_value()) {
        Some(renderer) => format!("--as {}", renderer.get_name()),
        None => "wherever alpha reaches 1/255".to_owned(),
    };
    dataset.choices.insert("drawn", drawn);
    if !quiet {
        for note in &dataset.notes {
            eprintln!("gaurast: {note}");
        }
    }

    let camera_arguments = arguments.modes.cameras(&CameraArguments::default());
    let views = dataset.views.iter().map(|measured| measured.view.clone()).collect();
    let known = Known::File(Views { views, ..Views::default() });
    let views = cameras::of_scene(known, &camera_arguments, &scene, false)?.views;
    for (measured, view) in dataset.views.iter_mut().zip(views) {
        measured.view = view;
    }
    let cameras = dataset.views.iter().map(|measured| &measured.view.camera);
    let settings = drawing::settings(&arguments.modes, &scene, cameras.clone());
    if let Some(camera) = cameras.max_by_key(|c| u64::from(c.width) * u64::from(c.height)) {
        settings.check(camera).map_err(DrawError::Render)?;
        limits::check_memory(camera, false, BYTES_PER_PIXEL, dataset.views.len()).map_err(Error::Limit)?;
    }

    let results = arguments.output.as_ref().map(|folder| Results { folder: folder.clone() });
    let of_share = |at: &usize| arguments.shard.is_none_or(|shard| at % shard.count == shard.index);
    let share: Vec<usize> = (0..dataset.views.len()).filter(of_share).collect();
    let mut outcomes = Vec::new();
    let mut missing = Vec::new();
    for &at in &share {
        let name = &dataset.views[at].name;
        match results.as_ref().filter(|_| !arguments.force) {
            Some(results) if results.is_there(name) => {
                if !arguments.resume {
                    return Err(Error::There { path: results.path_of(name) });
                }
                outcomes.push(results.read(name, &dataset.choices)?);
            }
            _ => missing.push(at),
        }
    }
    if !missing.is_empty() {
        let step = progress.step("uploading");
        let mut drawing = Drawing::new(scene.into(), settings, arguments.modes.device.as_deref(), false, None)?;
        step.finish_and_clear();
        outcomes.extend(measure(&mut drawing, &dataset, &missing, results.as_ref(), progress)?);
    }
    if let Some(results) = &results
        && let Some(of_others) = results.all(&dataset)?
    {
        outcomes = of_others;
        Report { model: &arguments.model, dataset: &dataset, outcomes: &outcomes }.write(&results.folder)?;
    }
    let report = Report { model: &arguments.model, dataset: &dataset, outcomes: &outcomes };
    if arguments.json || !arguments.quiet {
        let mut stdout = std::io::stdout().lock();
        let text = if arguments.json { report.json().map_err(Error::Stdout)? } else { report.text() };
        stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()).map_err(Error::Stdout)?;
    }
    if let Some(limit) = arguments.fail_below
        && let Some(worst) = outcomes.iter().find(|outcome| outcome.measures.decibels() < limit)
    {
        return Err(Error::Below { name: worst.name.clone(), psnr: worst.measures.decibels(), limit });
    }
    Ok(())
}

/// The bytes per pixel that a comparison needs besides the drawn picture.
const BYTES_PER_PIXEL: u64 = 48;

/// Draws and measures the views with these indices. One is measured while the next one is drawn.
fn measure(
    drawing: &mut Drawing,
    dataset: &Dataset,
    indices: &[usize],
    results: Option<&Results>,
    progress: Progress,
) -> Result<Vec<Outcome>, Error> {
    let bar = progress.pictures(indices.len() as u64);
    let mut outcomes = Vec::new();
    std::thread::scope(|scope| {
        // The channel has no buffer, so that at most two pictures are in memory.
        let (send, receive) = sync_channel::<(&Measured, Picture)>(0);
        let measure_all = move || -> Result<Vec<Outcome>, Error> {
            let mut outcomes = Vec::new();
            for (measured, picture) in receive {
                outcomes.push(measure_one(measured, picture, dataset, results)?);
            }
            Ok(outcomes)
        };
        let measuring = std::thread::Builder::new()
            .spawn_scoped(scope, measure_all)
            .map_err(|error| Error::Draw(DrawError::Thread(error)))?;
        let mut failed = None;
        for &at in indices {
            let measured = &dataset.views[at];
            let picture = match drawing.frame(&measured.view) {
                Ok(frame) => frame.picture,
                Err(error) => {
                    failed = Some(error);
                    break;
                }
            };
            // The other thread reports the error that ended it.
            if send.send((measured, picture)).is_err() {
                break;
            }
            bar.inc(1);
        }
        drop(send);
        outcomes = measuring.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
        bar.finish_and_clear();
        failed.map_or(Ok(()), |error| Err(Error::Draw(error)))
    })?;
    Ok(outcomes)
}

/// Measures a drawn picture, and writes it.
fn measure_one(
    measured: &Measured,
    picture: Picture,
    dataset: &Dataset,
    results: Option<&Results>,
) -> Result<Outcome, Error> {
    let camera = &measured.view.camera;
    let photograph = resized(&gaurast_picture::read(&measured.photograph)?, [camera.width, camera.height]);
    let mut picture = picture.over(dataset.background);
    if let Some(exposure) = &measured.exposure {
        expose(&mut picture, exposure);
    }
    let mut picture = shown(picture, dataset.background);
    if dataset.values == Values::EightBits {
        picture = in_eight_bits(picture);
    }
    let mut photograph = shown(photograph, dataset.background);
    if let Some(path) = &measured.mask {
        let mask = resized(&gaurast_picture::read(path)?, [camera.width, camera.height]);
        for picture in [&mut picture, &mut photograph] {
            for (pixel, mask) in picture.pixels.iter_mut().zip(&mask.pixels) {
                if mask[0] < 0.5 {
                    *pixel = [0.0, 0.0, 0.0, 1.0];
                }
            }
        }
    }
    if dataset.right_half {
        (picture, photograph) = (right_half(&picture), right_half(&photograph));
    }
    let outcome = Outcome {
        name: measured.name.clone(),
        width: picture.width,
        height: picture.height,
        measures: Measures::of(&picture, &photograph),
    };
    if let Some(results) = results {
        let difference = difference(&picture, &photograph, outcome.measures.largest);
        results.write(&outcome, [&picture, &photograph, &difference], &dataset.choices)?;
    }
    Ok(outcome)
}

/// Multiplies colours by the matrix of an exposure, and adds its offset.
fn expose(picture: &mut Picture, exposure: &Exposure) {
    for pixel in &mut picture.pixels {
        let [r, g, b, alpha] = *pixel;
        let channel = |c: usize| r * exposure[0][c] + g * exposure[1][c] + b * exposure[2][c] + exposure[c][3];
        *pixel = [channel(0), channel(1), channel(2), alpha];
    }
}

fn right_half(picture: &Picture) -> Picture {
    let (width, left) = (picture.width as usize, picture.width as usize / 2);
    let rows = picture.pixels.chunks_exact(width).flat_map(|row| row[left..].iter().copied());
    Picture { width: (width - left) as u32, height: picture.height, pixels: rows.collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposures_are_rows_times_matrices() {
        let pixels = vec![[0.1, 0.2, 0.3, 1.0], [1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0]];
        let mut picture = Picture { width: 3, height: 1, pixels };
        expose(&mut picture, &[[1.0, 0.5, 0.0, 0.01], [0.0, 2.0, 0.0, 0.02], [0.0, 0.25, 1.0, 0.03]]);
        // torch.matmul(colour, exposure[:3, :3]) + exposure[:3, 3]
        let expected = [[0.11, 0.545, 0.33], [1.01, 0.52, 0.03], [0.01, 2.02, 0.03]];
        for (pixel, expected) in picture.pixels.iter().zip(expected) {
            assert!((0..3).all(|c| (pixel[c] - expected[c]).abs() < 1e-6), "{pixel:?} {expected:?}");
        }
        assert_eq!(right_half(&picture).pixels, picture.pixels[1..]);
    }
}
