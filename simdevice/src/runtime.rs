//! The runtime: the workers, the SIMD level and the configuration, which are chosen once when a device is created.

use crate::limits::{MAX_MACRO_TILE_SIZE, TILE_SIZE};
use crate::stats::optimizations::Optimizations;
use crate::stats::recorder::Recorder;
use fearless_simd::Level;
pub use isa::level::SimdLevel;
use isa::machine::Stopped;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::thread::JoinHandle;
use std::time::Duration;

/// The options of a device that is created.
#[derive(Clone, Debug)]
pub struct Config {
    /// Worker threads; 0 means one per processor.
    pub threads: usize,
    /// The SIMD level of every kernel.
    pub simd: SimdLevel,
    /// The side of a macro-tile in pixels: a multiple of 16 from 16 to 128. A macro-tile is the piece of a pass that
    /// one worker renders. The side never changes an image.
    pub macro_tile_size: u32,
    /// The size of a pass's bins, in bytes, beyond which the pass is flushed early.
    pub bin_budget_bytes: u64,
    /// The most bytes of host memory for copies of Gaussians in an order that is faster to read; see
    /// [`Optimization::ClusterCulling`](crate::stats::optimizations::Optimization::ClusterCulling). A Gaussian takes 48
    /// bytes, and 192 more for spherical harmonics of degree 3 if they fit.
    pub cluster_budget_bytes: u64,
    /// The policy that flushes passes.
    pub flush: FlushPolicy,
    /// The longest time that one batch of shader invocations may take.
    pub shader_timeout: Duration,
    /// The optimizations: work that is omitted because it changes no pixel.
    pub optimizations: Optimizations,
    /// The recorder of the work of draws and dispatches, if work is to be recorded. It never changes an image.
    pub recorder: Option<Arc<Recorder>>,
    /// True if timestamps count the simulated hardware's nanoseconds instead of the host's.
    pub simulated_timestamps: bool,
}

/// The moments at which a pass's bins are rendered. They never change an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FlushPolicy {
    /// Flushes if the bins exceed the budget, at a barrier and at the end of the pass.
    WhenFull,
    /// Flushes after every draw, too.
    EveryDraw,
    /// Flushes after about one draw in three, too. The seed and the number of draws so far determine after which.
    SomeDraws(u64),
}

impl Default for Config {
    fn default() -> Self {
        Self {
            threads: 0,
            simd: SimdLevel::Best,
            macro_tile_size: 64,
            bin_budget_bytes: 256 << 20,
            cluster_budget_bytes: 512 << 20,
            flush: FlushPolicy::WhenFull,
            shader_timeout: Duration::from_secs(5),
            optimizations: Optimizations::default(),
            recorder: None,
            simulated_timestamps: false,
        }
    }
}

/// The reasons why a device could not be created.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// The processor lacks the SIMD level asked for.
    #[error("this processor does not support the SIMD level {0:?}")]
    UnsupportedSimdLevel(SimdLevel),
    /// A macro-tile of this side cannot be cut into tiles, or is too large.
    #[error("a macro-tile's side must be a multiple of 16 from 16 to 128, not {0}")]
    MacroTileSize(u32),
    /// The host refused to start threads.
    #[error("the worker pool cannot be started: {0}")]
    Threads(#[from] ThreadPoolBuildError),
}

/// The workers, the SIMD level and the configuration that kernels and stages use. Its threads are joined when it is
/// dropped.
#[derive(Debug)]
pub struct Runtime {
    workers: Workers,
    level: Level,
    config: Config,
    recorder: Arc<Recorder>,
}

impl Runtime {
    /// Starts the workers.
    ///
    /// # Errors
    /// [`DeviceError`] if the processor lacks the SIMD level, the macro-tile's side is impossible or the host refuses
    /// threads.
    pub fn new(config: &Config) -> Result<Self, DeviceError> {
        let level = config.simd.resolve().ok_or(DeviceError::UnsupportedSimdLevel(config.simd))?;
        let size = config.macro_tile_size;
        if !(TILE_SIZE..=MAX_MACRO_TILE_SIZE).contains(&size) || !size.is_multiple_of(TILE_SIZE) {
            return Err(DeviceError::MacroTileSize(size));
        }
        Ok(Self {
            workers: Workers::new(config.threads)?,
            level,
            config: config.clone(),
            recorder: config.recorder.clone().unwrap_or_default(),
        })
    }

    /// The configuration that it was created with.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The recorder, if work is recorded at present: because the configuration has a recorder or simulated timestamps,
    /// or because a query listens.
    pub(crate) fn recorder(&self) -> Option<&Recorder> {
        let config = &self.config;
        let wanted = config.recorder.is_some() || config.simulated_timestamps || self.recorder.has_listeners();
        wanted.then_some(&*self.recorder)
    }

    /// The recorder that queries listen to.
    pub(crate) fn query_recorder(&self) -> &Recorder {
        &self.recorder
    }

    /// The SIMD level of every kernel.
    pub fn level(&self) -> Level {
        self.level
    }

    /// The number of workers.
    pub fn threads(&self) -> usize {
        self.workers.pool().map_or(1, ThreadPool::current_num_threads)
    }

    /// Runs `work` on the workers.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        match self.workers.pool() {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }

    /// Shares tasks among workers. A worker takes `piece` tasks at a time and does them in order. Its state is made
    /// when it takes its first task. When a task stops, `cancel` is set and no more tasks are taken.
    ///
    /// Returns the states of all workers, and the error of the task that stopped. Errors of tasks that were cancelled
    /// for it are ignored.
    pub(crate) fn share<W: Send>(
        &self,
        tasks: Range<u64>,
        piece: u64,
        cancel: &AtomicBool,
        new_worker: impl Fn() -> W + Sync,
        run: impl Fn(&mut W, u64) -> Result<(), Stopped> + Sync,
    ) -> (Vec<W>, Result<(), Stopped>) {
        let next = AtomicU64::new(tasks.start);
        let work = || {
            let mut worker = None;
            let mut ran = Ok(());
            while ran.is_ok() && !cancel.load(Relaxed) {
                let first = next.fetch_add(piece, Relaxed);
                if first >= tasks.end {
                    break;
                }
                let worker = worker.get_or_insert_with(&new_worker);
                let mut taken = first..tasks.end.min(first + piece);
                ran = taken.try_for_each(|task| run(worker, task));
            }
            if ran.is_err() {
                cancel.store(true, Relaxed);
            }
            (worker, ran)
        };
        let pieces = (tasks.end - tasks.start).div_ceil(piece);
        let done: Vec<_> = match pieces.min(self.threads() as u64) {
            0 => Vec::new(),
            1 => vec![work()],
            workers => self.install(|| (0..workers).into_par_iter().map(|_| work()).collect()),
        };
        let failures = done.iter().filter_map(|(_, ran)| ran.err());
        let failure = failures.min_by_key(|stopped| *stopped == Stopped::Cancelled);
        let workers = done.into_iter().filter_map(|(worker, _)| worker);
        (workers.collect(), failure.map_or(Ok(()), Err))
    }
}

/// A thread pool that joins its threads when it is dropped. rayon's pool only tells its threads to stop, which is not
/// enough for a driver that may be unloaded as soon as its device is destroyed.
#[derive(Debug)]
struct Workers {
    /// The pool; `None` only while it is dropped.
    pool: Option<ThreadPool>,
    threads: Vec<JoinHandle<()>>,
}

impl Workers {
    /// Starts `count` threads; 0 starts one per processor. It is never a part of its caller, so that sizes of functions do not depend on
    /// what the compiler chooses.
    #[inline(never)]
    fn new(count: usize) -> Result<Self, ThreadPoolBuildError> {
        let mut workers = Self { pool: None, threads: Vec::new() };
        let pool = ThreadPoolBuilder::new()
            .num_threads(count)
            .spawn_handler(|worker| {
                let name = format!("gaurast-{}", worker.index());
                let spawned = std::thread::Builder::new().name(name).spawn(|| worker.run());
                workers.threads.push(spawned?);
                Ok(())
            })
            .build()?;
        workers.pool = Some(pool);
        Ok(workers)
    }

    /// The pool, or `None` while it is being dropped.
    fn pool(&self) -> Option<&ThreadPool> {
        self.pool.as_ref()
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        // The threads end after the pool is dropped.
        self.pool = None;
        for thread in self.threads.drain(..) {
            // A panic of a worker was already passed on to the caller of its work.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[gaurast_runner::test]
    fn impossible_macro_tiles_are_refused() {
        for macro_tile_size in [0, 8, 40, 144, u32::MAX] {
            let config = Config { threads: 1, macro_tile_size, ..Config::default() };
            assert!(matches!(
                Runtime::new(&config),
                Err(DeviceError::MacroTileSize(size)) if size == macro_tile_size
            ));
        }
    }

    #[gaurast_runner::test]
    fn threads_are_gone_when_the_pool_is() {
        let witness = Arc::new(());
        let workers = Workers::new(3).unwrap();
        let pool = workers.pool().unwrap();
        assert_eq!(pool.current_num_threads(), 3);
        thread_local!(static KEPT: std::cell::RefCell<Option<Arc<()>>> = const { std::cell::RefCell::new(None) });
        pool.broadcast(|_| KEPT.with(|kept| *kept.borrow_mut() = Some(witness.clone())));
        assert_eq!(Arc::strong_count(&witness), 4);
        drop(workers);
        assert_eq!(Arc::strong_count(&witness), 1, "thread locals die with their threads");
    }

    #[gaurast_runner::test]
    fn tasks_are_shared_until_one_stops() {
        let runtime = Runtime::new(&Config { threads: 3, ..Config::default() }).unwrap();
        let cancel = AtomicBool::new(false);
        let (workers, done) = runtime.share(5..100, 4, &cancel, Vec::new, |worker, task| {
            worker.push(task);
            Ok(())
        });
        let mut tasks = workers.concat();
        tasks.sort_unstable();
        assert_eq!(tasks, (5..100).collect::<Vec<_>>());
        assert_eq!(done, Ok(()));
        let timed_out = Stopped::TimedOut { limit: Duration::ZERO };
        let stopping = |_: &mut (), task| match task {
            70 => Err(timed_out),
            _ if cancel.load(Relaxed) => Err(Stopped::Cancelled),
            _ => Ok(()),
        };
        let (_, done) = runtime.share(0..100, 1, &cancel, || (), stopping);
        assert_eq!(done, Err(timed_out));
        assert!(cancel.load(Relaxed));
    }
}
