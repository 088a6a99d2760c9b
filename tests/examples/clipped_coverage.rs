//! Counts the samples of triangles that planes of the view volume cut, for which this driver, lavapipe and exact arithmetic
//! disagree: random triangles, and a floor under the eye with corners behind it.
//!
//! `clipped_coverage [TIMES]` draws a thousand random triangles of each kind TIMES times (1 by default).

use gaurast_testkit::{Gpu, Settings};
use gaurast_tests::triangles::checksum::{Checksums, numbers};
use gaurast_tests::triangles::clipped::{FRAME, FRAMES, KINDS, SIZE, clipped, floor};
use gaurast_tests::triangles::edges::{Position, covers, is_near, lines, to_clip};

/// The numbers of samples.
#[derive(Default)]
struct Counts {
    samples: usize,
    /// The two drivers differ.
    differ: usize,
    /// This driver is not exact.
    own_wrong: usize,
    /// lavapipe is not exact.
    their_wrong: usize,
    /// Either is not exact, and no edge is within 1/256 of a pixel.
    far: usize,
}

impl Counts {
    fn add(&mut self, devices: [&Gpu; 2], triangles: &[[Position; 3]], size: u32) {
        let clip: Vec<_> = (triangles.iter()).map(|corners| corners.map(to_clip)).collect();
        let count = triangles.len() as u32;
        let [own, their] = devices.map(|gpu| {
            let sums = Checksums::new(gpu, &clip, [size; 2], 1).draw(0..count);
            sums.into_iter().next().expect("a sample")
        });
        for (pixel, (own, their)) in (0..).zip(own.iter().zip(&their)) {
            let place = [pixel % size, pixel / size].map(|pixel| 16 * pixel + 8);
            let mut exact = [0.0; 4];
            for (index, triangle) in (0..).zip(triangles) {
                if covers(triangle, size, place) {
                    let own = numbers(index);
                    exact = [0, 1, 2, 3].map(|channel| exact[channel] + own[channel]);
                }
            }
            self.samples += 1;
            self.differ += usize::from(own != their);
            self.own_wrong += usize::from(*own != exact);
            self.their_wrong += usize::from(*their != exact);
            if *own != exact || *their != exact {
                let mut edges = triangles.iter().flat_map(lines);
                let is_explained = edges.any(|line| is_near(line, size, place));
                self.far += usize::from(!is_explained);
            }
        }
    }

    fn tell(&self, name: &str) {
        println!(
            "{name:<16}{:>10}{:>10}{:>12}{:>12}{:>8}",
            self.samples, self.differ, self.own_wrong, self.their_wrong, self.far
        );
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let times: u64 = match std::env::args().nth(1) {
        Some(times) => times.parse()?,
        None => 1,
    };
    let (own, lavapipe) = (Gpu::embedded(&Settings::default())?, Gpu::lavapipe()?);
    println!("{:<16}{:>10}{:>10}{:>12}{:>12}{:>8}", "cut by", "samples", "differ", "own wrong", "lp wrong", "far");
    for (name, seed, plane) in KINDS {
        let mut counts = Counts::default();
        for time in 0..times {
            let triangles = clipped(seed + 1000 * time, 1000, plane);
            counts.add([&own, &lavapipe], &triangles, SIZE);
        }
        counts.tell(name);
    }
    for frame in 0..FRAMES {
        let mut counts = Counts::default();
        counts.add([&own, &lavapipe], &floor(frame), FRAME);
        counts.tell(&format!("floor, frame {frame}"));
    }
    Ok(())
}
