//! Counts the instructions of a process by Callgrind. Unlike time, the count does not depend on the machine's load.

use std::io::Write;
use std::process::{Command, Stdio};

use thiserror::Error;

/// The SIMD level, the highest that Valgrind knows.
pub const LEVEL: &str = "avx2";

/// Failures of a count. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum CallgrindError {
    #[error("Callgrind could not be run: {0}")]
    Io(#[from] std::io::Error),
    #[error("a process that Callgrind ran failed: {0}")]
    Failed(String),
}

/// A process that ran to its end.
pub struct Counted {
    /// The instructions of all its threads.
    pub instructions: u64,
    /// Its standard output.
    pub output: String,
}

/// Runs this program at [`LEVEL`] on one thread: with `arguments` and more `environment`, and with `input` as its
/// standard input.
///
/// # Errors
/// If Callgrind is not installed, or the process fails.
pub fn count(arguments: &[&str], environment: &[(&str, &str)], input: &[u8]) -> Result<Counted, CallgrindError> {
    let mut child = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(std::env::current_exe()?)
        .args(arguments)
        .env("GAURAST_SIMD", LEVEL)
        .env("GAURAST_THREADS", "1")
        .envs(environment.iter().copied())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()?;
    if let Some(mut stdin) = child.stdin.take() {
        stdin.write_all(input)?;
    }
    let output = child.wait_with_output()?;
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let instructions = collected(&said).filter(|_| output.status.success());
    Ok(Counted {
        instructions: instructions.ok_or(CallgrindError::Failed(said))?,
        output: String::from_utf8_lossy(&output.stdout).into_owned(),
    })
}

/// The number of instructions that Callgrind reports.
fn collected(said: &str) -> Option<u64> {
    let count = |line: &str| line.split_once("Collected : ")?.1.trim().parse().ok();
    said.lines().find_map(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn callgrinds_count_is_found() {
        let said = "==7== Events    : Ir\n==7== Collected : 1234\n==7== \n";
        assert_eq!(collected(said), Some(1234));
        assert_eq!(collected("==7== Events    : Ir\n"), None);
    }
}
