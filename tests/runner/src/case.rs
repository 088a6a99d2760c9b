//! A running test: its variant, its shard, its process.

use std::ffi::OsString;
use std::process::Command;
use std::sync::OnceLock;

use crate::need::{Ignored, Missing, Need, ignore};

/// One of the forms in which a test runs. Its name is appended to the test's name.
#[derive(Clone, Debug)]
pub struct Variant {
    /// The variant's name.
    pub name: String,
    /// Requirements of this variant, in addition to the test's own.
    pub needs: Vec<Need>,
}

impl Variant {
    /// A variant that needs nothing.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), needs: Vec::new() }
    }
}

/// A variant for each SIMD level, with the names of `GAURAST_SIMD`. A level that the processor lacks is ignored and
/// reported.
pub fn simd_levels() -> Vec<Variant> {
    crate::SIMD_LEVELS.map(|level| Variant { name: level.to_owned(), needs: vec![Need::SimdLevel(level)] }).into()
}

/// Variants that divide a test's work by [`Case::shard`].
pub fn shards(count: usize) -> Vec<Variant> {
    (1..=count).map(|index| Variant::new(format!("{index} of {count}"))).collect()
}

/// A part of a test's work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// The part's number, from 0.
    pub index: usize,
    /// The number of parts.
    pub count: usize,
}

impl Shard {
    /// Returns true if item number `item` of the work belongs to this part.
    pub fn has(self, item: usize) -> bool {
        item % self.count == self.index
    }

    /// This part's contiguous share of `total` items.
    pub fn range(self, total: u64) -> std::ops::Range<u64> {
        let at = |index: usize| total * index as u64 / self.count as u64;
        at(self.index)..at(self.index + 1)
    }
}

/// The environment at the first call. Tests that run at the same time may change it temporarily.
pub(crate) fn first_environment() -> &'static [(OsString, OsString)] {
    static FIRST: OnceLock<Vec<(OsString, OsString)>> = OnceLock::new();
    FIRST.get_or_init(|| std::env::vars_os().collect())
}

/// A running test.
#[derive(Debug)]
pub struct Case {
    pub(crate) name: String,
    pub(crate) variant: Option<String>,
}

/// The variable that holds the test's name in the test's own process.
const ALONE: &str = "GAURAST_TEST_ALONE";
/// The beginning of the line by which a test's own process reports that the test is ignored; the reason follows.
const IGNORED: &str = "gaurast-runner: ignored: ";

impl Case {
    /// The test's name, as the runner prints it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The name of the variant.
    ///
    /// # Panics
    /// If the test has no variants.
    pub fn variant(&self) -> &str {
        self.variant.as_deref().expect("a test with variants")
    }

    /// The part of the work, for a test with variants of [`shards`].
    ///
    /// # Panics
    /// If the test has other variants, or none.
    pub fn shard(&self) -> Shard {
        let (index, count) = self.variant().split_once(" of ").expect("a shard");
        let number = |text: &str| text.parse::<usize>().expect("a shard's number");
        Shard { index: number(index) - 1, count: number(count) }
    }

    /// Returns true if this process belongs to the test alone.
    pub fn is_alone(&self) -> bool {
        std::env::var_os(ALONE).is_some_and(|name| name == *self.name)
    }

    /// A command that runs this test again in a process of its own, with the initial environment of this process.
    pub fn command(&self) -> Command {
        let mut command = Command::new(std::env::current_exe().expect("the test's own path"));
        command
            .args(["--exact", &self.name, "--test-threads", "1"])
            .env_clear()
            .envs(first_environment().iter().cloned())
            .env(ALONE, &self.name)
            .env_remove(crate::report::REPORT);
        command
    }

    /// Runs this test again by [`Self::command`]; `set_up` may add to its environment. If the test is ignored there, it
    /// is ignored here too.
    ///
    /// # Panics
    /// If the test fails there; the message has the output of the process.
    pub fn run_alone(&self, set_up: impl FnOnce(&mut Command)) {
        let mut command = self.command();
        set_up(&mut command);
        let output = command.output().expect("the test starts itself");
        let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "in a process of its own ({}):\n{text}", output.status);
        if let Some(line) = text.lines().find_map(|line| line.strip_prefix(IGNORED)) {
            let (missing, reason) = line.split_once(' ').expect("what is missing, and why");
            ignore(Missing::from_name(missing), reason);
        }
        assert!(text.contains(" 1 passed"), "the test did not run:\n{text}");
    }

    /// Reports to the waiting parent process that the test is ignored.
    pub(crate) fn say_ignored(&self, ignored: &Ignored) {
        if self.is_alone() {
            println!("\n{IGNORED}{:?} {}", ignored.missing, ignored.reason);
        }
    }
}
