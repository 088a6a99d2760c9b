//! `gaurast` when it is interrupted, the disk is full or the reader is gone. Existing files stay, no incomplete file is
//! left, and there is one sentence on stderr.

use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use tempfile::TempDir;

const SIGINT: i32 = 2;

fn gaurast(folder: &TempDir, arguments: &[&str]) -> Command {
    let mut command = Command::new("env");
    command
        // A shell that runs tests in the background ignores interrupts, and its children would inherit that.
        .args(["--default-signal=INT", env!("CARGO_BIN_EXE_gaurast")])
        .args(arguments)
        .current_dir(folder)
        .env_remove("RUST_LOG")
        .stdin(Stdio::null());
    command
}

fn files(folder: &TempDir) -> usize {
    std::fs::read_dir(folder).expect("readable").count()
}

fn read(path: &Path) -> Vec<u8> {
    std::fs::read(path).expect("readable")
}

/// Checks that the run failed with exit code 1 and one line that begins with `message`.
#[track_caller]
fn failed(output: &Output, message: &str) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    assert!(stderr.starts_with(message), "{stderr} is not {message}");
}

fn interrupt(child: &Child) {
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.expect("there is kill").success());
}

#[gaurast_runner::test]
fn an_interrupted_render_leaves_the_picture_that_was_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.exr");
    let old: &[u8] = b"an earlier picture";
    let mut interrupted = 0;
    for step in 0..12 {
        std::fs::write(&path, old).expect("written");
        let arguments = ["render", "-q", "--force", "--size", "1500x1000", "-o", "a.exr"];
        let mut child = gaurast(&folder, &arguments).spawn().expect("it starts");
        // The interrupt comes at any time between the first step and the last.
        std::thread::sleep(Duration::from_millis(step * 90));
        if child.try_wait().expect("its status").is_none() {
            interrupt(&child);
        }
        let status = child.wait().expect("its status");
        if status.success() {
            image::open(&path).expect("a whole picture");
        } else {
            assert_eq!(status.signal(), Some(SIGINT), "{status}");
            interrupted += 1;
            let found = read(&path);
            // The interrupt may have come after the last step.
            assert!(found == old || image::open(&path).is_ok(), "{} bytes", found.len());
        }
        assert_eq!(files(&folder), 1, "nothing is left beside it");
    }
    assert!(interrupted > 0);
}

#[gaurast_runner::test]
fn a_killed_run_goes_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |place: &'static str| ["render", "-q", "--orbit", "12", "--size", "320x240", "--resume", "-o", place];
    let whole = gaurast(&folder, &run("whole/")).status();
    assert!(whole.expect("it starts").success());
    let picture = |place: &str, index: u32| folder.path().join(format!("{place}/{index:05}.png"));
    // It is killed once the third picture is there.
    let mut child = gaurast(&folder, &run("parts/")).spawn().expect("it starts");
    while !picture("parts", 2).is_file() {
        assert!(child.try_wait().expect("its status").is_none(), "it is still drawing");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().expect("killed");
    child.wait().expect("its status");
    let there = |index: &u32| picture("parts", *index).is_file();
    let before = (0..12).filter(there).count();
    assert!((3..12).contains(&before), "{before} pictures before it was killed");
    let changed = |index: u32| picture("parts", index).metadata().and_then(|file| file.modified());
    let first = changed(0).expect("a time");
    let again = gaurast(&folder, &run("parts/")).status();
    assert!(again.expect("it starts").success());
    assert_eq!(changed(0).expect("a time"), first, "it is not drawn again");
    for index in 0..12 {
        assert!(read(&picture("parts", index)) == read(&picture("whole", index)), "{index}");
    }
}

#[gaurast_runner::test(needs = [gaurast_runner::Need::File("/dev/full")])]
fn a_full_disk_is_one_sentence() {
    let folder = tempfile::tempdir().expect("a folder");
    std::os::unix::fs::symlink("/dev/full", folder.path().join("a.png")).expect("a link");
    let arguments = ["render", "-q", "--size", "64x48", "-o", "b.png", "-o", "a.png"];
    let output = gaurast(&folder, &arguments).output().expect("it starts");
    failed(&output, "gaurast: a.png: No space left on device");
    image::open(folder.path().join("b.png")).expect("the one before is whole");
    assert_eq!(files(&folder), 2);
}

#[gaurast_runner::test]
fn a_limit_of_file_sizes_is_one_sentence_and_keeps_what_was_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.exr");
    std::fs::write(&path, "an earlier picture").expect("written");
    let command = env!("CARGO_BIN_EXE_gaurast");
    // The unit of the limit is 512 or 1024 bytes; the picture has three MiB.
    let line = format!("ulimit -f 64; exec '{command}' render -q --force --size 500x400 -o a.exr");
    let output = Command::new("sh").args(["-c", &line]).current_dir(&folder).output().expect("there is a shell");
    failed(&output, "gaurast: a.exr: File too large");
    assert_eq!(read(&path), b"an earlier picture");
    assert_eq!(files(&folder), 1);
}

#[gaurast_runner::test]
fn a_closed_pipe_is_one_sentence_and_the_picture_is_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let closed = |arguments: &[&str]| {
        let mut child =
            gaurast(&folder, arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
        drop(child.stdout.take());
        child.wait_with_output().expect("it ends")
    };
    let output = closed(&["render", "--size", "64x48", "-o", "a.png"]);
    failed(&output, "gaurast: the pictures are written, but not the report: Broken pipe");
    image::open(folder.path().join("a.png")).expect("a picture");
    failed(&closed(&["simulate", "--paper"]), "gaurast: output: Broken pipe");
    assert_eq!(files(&folder), 1);
}
