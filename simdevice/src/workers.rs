//! The device's worker threads: a pool of its own, whose threads are gone when it is dropped.

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use std::thread::JoinHandle;

/// A pool that joins its threads. rayon's own only tells them to stop, which is too late for a driver that may be
/// unloaded the moment its device is destroyed.
#[derive(Debug)]
pub(crate) struct Workers {
    /// Present until dropped.
    pool: Option<ThreadPool>,
    threads: Vec<JoinHandle<()>>,
}

impl Workers {
    /// Starts `count` threads; 0 means one per processor.
    pub(crate) fn new(count: usize) -> Result<Self, ThreadPoolBuildError> {
        let mut workers = Self {
            pool: None,
            threads: Vec::new(),
        };
        let pool = ThreadPoolBuilder::new()
            .num_threads(count)
            .spawn_handler(|worker| {
                let name = format!("gaurast-{}", worker.index());
                let spawned = std::thread::Builder::new()
                    .name(name)
                    .spawn(|| worker.run());
                workers.threads.push(spawned?);
                Ok(())
            })
            .build()?;
        workers.pool = Some(pool);
        Ok(workers)
    }

    /// The pool, or `None` while it is being dropped.
    pub(crate) fn pool(&self) -> Option<&ThreadPool> {
        self.pool.as_ref()
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        // Threads end only when the pool is gone.
        self.pool = None;
        for thread in self.threads.drain(..) {
            // A worker that panicked has told the caller of its work already.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    #[test]
    fn threads_are_gone_when_the_pool_is() {
        let witness = Arc::new(());
        let workers = Workers::new(3).unwrap();
        let pool = workers.pool().unwrap();
        assert_eq!(pool.current_num_threads(), 3);
        thread_local!(static KEPT: std::cell::RefCell<Option<Arc<()>>> = const { std::cell::RefCell::new(None) });
        pool.broadcast(|_| KEPT.with(|kept| *kept.borrow_mut() = Some(witness.clone())));
        assert_eq!(Arc::strong_count(&witness), 4);
        drop(workers);
        assert_eq!(
            Arc::strong_count(&witness),
            1,
            "thread locals die with their threads"
        );
    }
}
