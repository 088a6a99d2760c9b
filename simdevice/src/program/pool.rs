//! Pools of machines. A program lends its machines to the workers that run it.

use isa::machine::{Executable, Machine};
use std::ops::{Deref, DerefMut};
use std::sync::{Arc, Mutex, PoisonError};

/// The machines of an executable: as many as were ever in use at once.
#[derive(Debug)]
pub(crate) struct MachinePool {
    executable: Arc<Executable>,
    idle: Mutex<Vec<Machine>>,
}

impl MachinePool {
    pub(crate) fn new(executable: Executable) -> Self {
        Self { executable: Arc::new(executable), idle: Mutex::default() }
    }

    /// Lends a machine. Its registers hold whatever an earlier run left.
    pub(crate) fn lend(&self) -> PooledMachine<'_> {
        let idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let machine = idle.unwrap_or_else(|| Machine::new(Arc::clone(&self.executable)));
        PooledMachine { pool: self, machine: Some(machine) }
    }
}

/// A machine that returns to its pool when it is dropped.
#[derive(Debug)]
pub(crate) struct PooledMachine<'a> {
    pool: &'a MachinePool,
    /// The machine; `None` only while it is dropped.
    machine: Option<Machine>,
}

impl Deref for PooledMachine<'_> {
    type Target = Machine;

    #[inline]
    fn deref(&self) -> &Machine {
        self.machine.as_ref().expect("present until dropped")
    }
}

impl DerefMut for PooledMachine<'_> {
    #[inline]
    fn deref_mut(&mut self) -> &mut Machine {
        self.machine.as_mut().expect("present until dropped")
    }
}

impl Drop for PooledMachine<'_> {
    fn drop(&mut self) {
        if let Some(machine) = self.machine.take() {
            let idle = &self.pool.idle;
            idle.lock().unwrap_or_else(PoisonError::into_inner).push(machine);
        }
    }
}
