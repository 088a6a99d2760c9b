//! Two workers that draw the same views in turns.
//!
//! The workers are compared view by view, each by the quickest of several draws: other load on the machine only adds
//! time, and views differ by more than the effect in question. All is measured twice, with the processes started in one
//! order and in the other. The reason: of two equal processes, the first has been seen to take up to a tenth longer for
//! as long as both run.

use gaurast_render::Settings;
use gaurast_scene::camera::Camera;

use super::worker::{Contender, Drawn, Worker};
use crate::error::BenchError;
use crate::median::median;
use crate::workload::Workload;

/// The way in which views are drawn.
#[derive(Clone, Copy, Debug)]
pub enum Draws {
    /// Each view is drawn this many times.
    Again(usize),
    /// Each view is drawn once, since the time of a frame depends on the frame before.
    Once,
}

/// The draws of both workers.
pub struct Pair {
    /// The draws by worker, view, round and repetition.
    draws: [Vec<[Vec<Drawn>; 2]>; 2],
}

impl Pair {
    /// Draws `views` with two workers, each with its own workload and driver settings. The first view is a warm-up.
    pub fn draw(
        setups: [(&Workload, &str); 2],
        threads: usize,
        views: &[Camera],
        how: Draws,
    ) -> Result<Self, BenchError> {
        let start = |(workload, optimizations): (&Workload, &str)| {
            Worker::with_optimizations(Contender::Gaurast, workload, threads, optimizations)?
                .ok_or_else(|| BenchError::Worker("this driver is not there".to_owned()))
        };
        let mut draws = [0, 1].map(|_| vec![[Vec::new(), Vec::new()]; views.len()]);
        for round in 0..2 {
            let mut workers = [start(setups[round])?, start(setups[1 - round])?];
            if round == 1 {
                workers.swap(0, 1);
            }
            for (at, view) in views.iter().enumerate() {
                for (worker, draws) in workers.iter_mut().zip(&mut draws) {
                    draws[at][round] = match how {
                        Draws::Again(times) => (0..times)
                            .map(|_| worker.draw(view, Settings::default(), None))
                            .collect::<Result<_, _>>()?,
                        Draws::Once => vec![worker.draw_next(view)?],
                    };
                }
            }
        }
        Ok(Self { draws })
    }

    /// The quickest draw of each of a worker's views, measured by `of`: the mean of both rounds.
    fn least(&self, worker: usize, of: impl Fn(&Drawn) -> f64) -> impl Iterator<Item = f64> {
        let least = move |draws: &Vec<Drawn>| draws.iter().map(&of).fold(f64::INFINITY, f64::min);
        let views = self.draws[worker].iter().skip(1);
        views.map(move |[one, other]| f64::midpoint(least(one), least(other)))
    }

    /// The median over views of each worker's quickest draws.
    pub fn medians(&self, of: impl Fn(&Drawn) -> f64) -> [f64; 2] {
        [0, 1].map(|worker| median(self.least(worker, &of)))
    }

    /// Lower quartile, median and upper quartile, over views, of `compare` applied to both workers' quickest draws.
    pub fn quartiles(&self, of: impl Fn(&Drawn) -> f64, compare: impl Fn(f64, f64) -> f64) -> [f64; 3] {
        let pairs = self.least(0, &of).zip(self.least(1, &of));
        quartiles(pairs.map(|(first, second)| compare(first, second)))
    }

    /// The maximum over all draws of the first worker, including the warm-up.
    pub fn most(&self, of: impl Fn(&Drawn) -> f64) -> f64 {
        let draws = self.draws[0].iter().flatten().flatten();
        draws.map(of).fold(0.0, f64::max)
    }
}

/// A frame's processor time, or its wall time if the system does not report processor time.
pub fn time(frame: &Drawn) -> f64 {
    frame.processor.unwrap_or(frame.wall)
}

/// Lower quartile, median and upper quartile.
fn quartiles(values: impl Iterator<Item = f64>) -> [f64; 3] {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let at = |quarters| values.len().saturating_sub(1) * quarters / 4;
    [1, 2, 3].map(|quarters| values.get(at(quarters)).copied().unwrap_or(f64::NAN))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(wall: f64) -> Drawn {
        Drawn { wall, processor: None, counters: Vec::new(), stages: Vec::new(), memory: None }
    }

    #[test]
    fn quartiles_of_values() {
        let values = [5.0, 1.0, 4.0, 2.0, 3.0];
        assert_eq!(quartiles(values.into_iter()), [2.0, 3.0, 4.0]);
        assert_eq!(quartiles([7.0].into_iter()), [7.0; 3]);
        assert!(quartiles([].into_iter())[1].is_nan());
    }

    #[test]
    fn views_are_compared_by_their_quickest_draws() {
        let view = |one: [f64; 2], other: f64| [one.map(drawn).to_vec(), vec![drawn(other)]];
        let pair = Pair {
            draws: [
                vec![view([90., 80.], 95.), view([12., 10.], 12.), view([20., 29.], 20.), view([31., 30.], 34.)],
                vec![view([70., 60.], 99.), view([10., 18.], 12.), view([21., 25.], 23.), view([33., 99.], 33.)],
            ],
        };
        // The quickest draws are 11, 20, 32 and 11, 22, 33; the first view is the warm-up.
        assert_eq!(pair.medians(time), [20.0, 22.0]);
        assert_eq!(pair.quartiles(time, |a, b| b - a), [0.0, 1.0, 1.0]);
        assert_eq!(pair.most(time), 95.0);
    }
}
