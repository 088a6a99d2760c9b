//! Tables that are stored next to the sources, one row per line, and compared with measurements.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::error::CountsError;

/// A table of rows by name. A name may have several parts, the first cells of a row.
pub(super) struct Table {
    path: PathBuf,
    comment: &'static str,
    header: &'static [&'static str],
    rows: BTreeMap<Vec<String>, Vec<String>>,
}

impl Table {
    /// Loads the stored table of a file name. The first `names` columns name its rows. The table is empty if there is
    /// no file.
    pub(super) fn load(
        file: &str,
        comment: &'static str,
        header: &'static [&'static str],
        names: usize,
    ) -> Result<Self, CountsError> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("stored").join(file);
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(error.into()),
        };
        let mut table = Self { path, comment, header, rows: BTreeMap::new() };
        let lines = text.lines().filter(|line| !line.starts_with('#'));
        for line in lines.skip(1) {
            let cells: Vec<&str> = line.split(',').collect();
            if cells.len() != header.len() {
                return Err(CountsError::Stored(line.to_owned()));
            }
            table.set(&cells[..names], &cells[names..]);
        }
        Ok(table)
    }

    /// The cells of a row without its name.
    pub(super) fn get(&self, name: &[&str]) -> Option<&[String]> {
        let name: Vec<String> = name.iter().map(|part| (*part).to_owned()).collect();
        self.rows.get(&name).map(Vec::as_slice)
    }

    /// The names of all rows, in order.
    pub(super) fn names(&self) -> impl Iterator<Item = &[String]> {
        self.rows.keys().map(Vec::as_slice)
    }

    /// Replaces a row, or adds it.
    pub(super) fn set(&mut self, name: &[&str], cells: &[&str]) {
        let owned = |cells: &[&str]| cells.iter().map(|cell| (*cell).to_owned()).collect();
        self.rows.insert(owned(name), owned(cells));
    }

    /// Removes every row.
    pub(super) fn clear(&mut self) {
        self.rows.clear();
    }

    /// Writes the table to its file.
    pub(super) fn store(&self) -> Result<(), CountsError> {
        let mut text = format!("# {}\n{}\n", self.comment, self.header.join(","));
        for (name, cells) in &self.rows {
            text += &(name.join(",") + "," + &cells.join(",") + "\n");
        }
        if let Some(folder) = self.path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        std::fs::write(&self.path, text)?;
        println!("stored: {}", self.path.display());
        Ok(())
    }
}

/// The difference of a figure from the stored one, in percent of the stored one.
pub(super) fn percent(figure: u64, stored: u64) -> f64 {
    100.0 * (figure as f64 / stored as f64 - 1.0)
}
