//! Atomic writes: a file appears with all its contents, or is not changed.

use std::io::{self, Write};
use std::path::Path;

use tempfile::NamedTempFile;

/// Writes `bytes` to the file `path`. The file that was there is replaced when everything has been written, and is
/// unchanged if something fails. A path that is not a regular file, such as a pipe or a device, is written to directly.
///
/// # Errors
/// Returns the system's error.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> io::Result<()> {
    if path.metadata().is_ok_and(|there| !there.is_file()) {
        return std::fs::write(path, bytes);
    }
    if let Some(done) = unnamed::replace(path, bytes) {
        return done;
    }
    let mut file = builder().tempfile_in(folder(path))?;
    file.write_all(bytes)?;
    persist(file, path)
}

/// The folder that the file `path` is in.
pub fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

fn builder() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".gaurast-");
    // Permissions of an ordinary new file; the crate's default is private.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder
}

fn persist(file: NamedTempFile, path: &Path) -> io::Result<()> {
    file.persist(path).map_err(|error| error.error)?;
    Ok(())
}

/// Files without a name until they are written, so that an interrupted process leaves none behind.
#[cfg(target_os = "linux")]
mod unnamed {
    use super::{builder, folder};
    use rustix::fs::{AtFlags, CWD, Mode, OFlags, linkat, openat};
    use std::fs::File;
    use std::io::{self, Write};
    use std::os::fd::AsRawFd;
    use std::path::Path;

    /// Replaces like [`super::write_atomically`]. None if the file system has no unnamed files.
    pub(super) fn replace(path: &Path, bytes: &[u8]) -> Option<io::Result<()>> {
        let flags = OFlags::WRONLY | OFlags::TMPFILE | OFlags::CLOEXEC;
        let file = openat(CWD, folder(path), flags, Mode::from_raw_mode(0o666)).ok()?;
        let mut file = File::from(file);
        if let Err(error) = file.write_all(bytes) {
            return Some(Err(error));
        }
        let written = format!("/proc/self/fd/{}", file.as_raw_fd());
        // It gets a name of its own first, because a link can't replace a file.
        let named =
            builder().make_in(folder(path), |name| Ok(linkat(CWD, &written, CWD, name, AtFlags::SYMLINK_FOLLOW)?));
        let replaced = named.ok()?.into_temp_path().persist(path);
        Some(replaced.map_err(|error| error.error))
    }
}

#[cfg(not(target_os = "linux"))]
mod unnamed {
    pub(super) fn replace(_: &std::path::Path, _: &[u8]) -> Option<std::io::Result<()>> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).expect("readable");
        let name =
            |entry: io::Result<std::fs::DirEntry>| entry.expect("an entry").file_name().into_string().expect("text");
        entries.map(name).collect()
    }

    #[test]
    fn files_are_replaced_whole_or_stay() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a");
        for contents in ["one", "two, longer", ""] {
            write_atomically(&path, contents.as_bytes()).expect("written");
            assert_eq!(std::fs::read_to_string(&path).expect("read"), contents);
        }
        assert_eq!(names(folder.path()), ["a"]);
        let missing = folder.path().join("no/a");
        assert!(write_atomically(&missing, b"x").is_err());
        let taken = folder.path().join("b");
        std::fs::create_dir(&taken).expect("a folder");
        assert!(write_atomically(&taken, b"x").is_err(), "a folder is no file");
        assert_eq!(names(folder.path()).len(), 2);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn devices_are_written_to() {
        let folder = tempfile::tempdir().expect("a folder");
        let link = folder.path().join("full");
        std::os::unix::fs::symlink("/dev/full", &link).expect("a link");
        let error = write_atomically(&link, b"x").expect_err("it is full");
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
        assert!(link.is_symlink());
        write_atomically(Path::new("/dev/null"), b"x").expect("it takes everything");
    }
}
