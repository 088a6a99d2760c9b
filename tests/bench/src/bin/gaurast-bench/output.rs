//! Figures as CSV, JSON and tables.

use std::path::Path;

use comfy_table::presets::UTF8_FULL_CONDENSED;
use comfy_table::{CellAlignment, Table};
use serde::Serialize;

use crate::error::BenchError;

/// Rows of text with a header, for CSV files and tables.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    pub header: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Rows {
    pub fn new(header: &[&str]) -> Self {
        Self { header: header.iter().map(|name| (*name).to_owned()).collect(), rows: Vec::new() }
    }

    /// The rows for a terminal; columns of numbers are right-aligned.
    pub fn table(&self) -> Table {
        let mut table = Table::new();
        table.load_style(UTF8_FULL_CONDENSED);
        table.set_header(&self.header);
        for row in &self.rows {
            table.add_row(row);
        }
        for index in 0..self.header.len() {
            let numbers = self.rows.iter().all(|row| row[index].starts_with(|c: char| c.is_ascii_digit() || c == '-'));
            if let Some(column) = table.column_mut(index).filter(|_| numbers) {
                column.set_cell_alignment(CellAlignment::Right);
            }
        }
        table
    }

    /// The rows as comma-separated values, after a comment that begins with `#`.
    pub fn csv(&self, comment: &str) -> String {
        let line = |cells: &[String]| {
            let cells: Vec<String> = cells.iter().map(|cell| quoted(cell)).collect();
            cells.join(",") + "\n"
        };
        let mut text = format!("# {comment}\n");
        text += &line(&self.header);
        for row in &self.rows {
            text += &line(row);
        }
        text
    }
}

fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.to_owned() }
}

/// A number with as many digits as are significant.
pub fn number(value: f64) -> String {
    match value.abs() {
        _ if value.is_nan() => "-".to_owned(),
        0.0 => "0".to_owned(),
        100.0.. => format!("{value:.0}"),
        10.0.. => format!("{value:.1}"),
        0.01.. => format!("{value:.3}"),
        _ => format!("{value:.2e}"),
    }
}

/// Bytes as MiB.
pub fn mebibytes(bytes: Option<u64>) -> String {
    bytes.map_or("-".to_owned(), |bytes| format!("{:.0}", bytes as f64 / f64::from(1 << 20)))
}

/// Writes `text` to `path`, making its folder.
pub fn write(path: &Path, text: &str) -> Result<(), BenchError> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    Ok(gaurast_picture::write_atomically(path, text.as_bytes())?)
}

/// Writes `value` as JSON for people.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), BenchError> {
    write(path, &(serde_json::to_string_pretty(value)? + "\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_quoted_where_they_must_be() {
        let mut rows = Rows::new(&["scene", "ms"]);
        rows.rows.push(vec!["tile, \"dust\"".to_owned(), number(12.34)]);
        assert_eq!(rows.csv("machine"), "# machine\nscene,ms\n\"tile, \"\"dust\"\"\",12.3\n");
        assert!(rows.table().to_string().contains("12.3"));
    }

    #[test]
    fn numbers_are_short() {
        let shown: Vec<String> = [0.0, 1e-6, 0.0123, 1.5, 12.34, 899.4, f64::NAN].map(number).to_vec();
        assert_eq!(shown, ["0", "1.00e-6", "0.012", "1.500", "12.3", "899", "-"]);
    }
}
