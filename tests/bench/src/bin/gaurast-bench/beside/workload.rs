//! Work that is measured.

/// Work that is prepared once and run many times.
pub(super) struct Workload(Box<dyn FnMut()>);

impl Workload {
    /// Work that `run` does; it panics if the driver fails.
    pub(super) fn of(run: impl FnMut() + 'static) -> Self {
        Self(Box::new(run))
    }

    /// Does the work, and waits for its completion.
    pub(super) fn run(&mut self) {
        (self.0)();
    }
}
