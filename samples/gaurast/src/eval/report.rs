//! The results of an evaluation: a table, JSON, CSV, and a page.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use comfy_table::presets::UTF8_FULL_CONDENSED;
use comfy_table::{CellAlignment, Table};
use gaurast_picture::{Picture, write_atomically};
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::dataset::Dataset;
use super::error::Error;
use crate::measures::{Means, Measures};
use crate::report::write_json;

/// The folders of the drawn pictures, of the photographs as they were compared, and of the differences. The first two are
/// named as those of 3DGS's `render.py`.
const PICTURES: [&str; 3] = ["renders", "gt", "differences"];

/// The result of a view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    pub name: String,
    pub width: u32,
    pub height: u32,
    #[serde(flatten)]
    pub measures: Measures,
}

/// The result of a view and the choices with which it was measured.
#[derive(Deserialize, Serialize)]
struct Stored {
    #[serde(flatten)]
    outcome: Outcome,
    choices: BTreeMap<String, String>,
}

/// The results of views in a folder.
pub struct Results {
    pub folder: PathBuf,
}

impl Results {
    /// The file of a view's result.
    pub fn path_of(&self, name: &str) -> PathBuf {
        self.folder.join("views").join(format!("{name}.json"))
    }

    /// Returns true if there is a result.
    pub fn is_there(&self, name: &str) -> bool {
        self.path_of(name).is_file()
    }

    /// The result of a view.
    ///
    /// # Errors
    /// If the file is none, or the choices were others.
    pub fn read(&self, name: &str, choices: &BTreeMap<&'static str, String>) -> Result<Outcome, Error> {
        let path = self.path_of(name);
        let text = std::fs::read_to_string(&path).map_err(|source| Error::Io { path: path.clone(), source })?;
        let stored: Stored =
            serde_json::from_str(&text).map_err(|source| Error::Json { path: path.clone(), source })?;
        if stored.choices != owned(choices) {
            return Err(Error::OtherChoices { path });
        }
        Ok(stored.outcome)
    }

    /// Writes the pictures of a view, and then its result.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(
        &self,
        outcome: &Outcome,
        pictures: [&Picture; 3],
        choices: &BTreeMap<&'static str, String>,
    ) -> Result<(), Error> {
        for (folder, picture) in PICTURES.iter().zip(pictures) {
            let path = self.folder.join(folder).join(format!("{}.png", outcome.name));
            let folder = gaurast_picture::folder(&path);
            std::fs::create_dir_all(folder).map_err(|source| Error::Io { path: folder.to_owned(), source })?;
            gaurast_picture::write(&path, picture, None)?;
        }
        let mut bytes = Vec::new();
        let stored = Stored { outcome: outcome.clone(), choices: owned(choices) };
        let path = self.path_of(&outcome.name);
        write_json(&mut bytes, &stored).map_err(|source| Error::Io { path: path.clone(), source })?;
        write_file(&path, &bytes)
    }

    /// The results of all views, in their order; none if one is missing.
    ///
    /// # Errors
    /// If a result cannot be read.
    pub fn all(&self, dataset: &Dataset) -> Result<Option<Vec<Outcome>>, Error> {
        if dataset.views.iter().any(|measured| !self.is_there(&measured.name)) {
            return Ok(None);
        }
        dataset
            .views
            .iter()
            .map(|measured| self.read(&measured.name, &dataset.choices))
            .collect::<Result<_, _>>()
            .map(Some)
    }
}

fn owned(choices: &BTreeMap<&'static str, String>) -> BTreeMap<String, String> {
    choices.iter().map(|(subject, choice)| ((*subject).to_owned(), choice.clone())).collect()
}

/// Writes a file as a whole, and its folder.
fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let io = |source| Error::Io { path: path.to_owned(), source };
    std::fs::create_dir_all(gaurast_picture::folder(path)).map_err(io)?;
    write_atomically(path, bytes).map_err(io)
}

/// An evaluation.
pub struct Report<'a> {
    pub model: &'a Path,
    pub dataset: &'a Dataset,
    pub outcomes: &'a [Outcome],
}

impl Report<'_> {
    fn means(&self) -> Means {
        Means::of(self.outcomes.iter().map(|outcome| &outcome.measures))
    }

    /// The choices and a table.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for (subject, choice) in &self.dataset.choices {
            let _ = writeln!(text, "{subject}: {choice}");
        }
        let mut table = Table::new();
        table.load_style(UTF8_FULL_CONDENSED);
        table.set_header(["view", "PSNR, dB", "SSIM, 3DGS", "SSIM, torchmetrics", "SSIM, pytorch-msssim", "FLIP"]);
        for Outcome { name, measures, .. } in self.outcomes {
            table.add_row(cells(name, &Means::of(std::iter::once(measures))));
        }
        table.add_row(cells(&format!("mean of {}", self.outcomes.len()), &self.means()));
        for column in 1..6 {
            if let Some(column) = table.column_mut(column) {
                column.set_cell_alignment(CellAlignment::Right);
            }
        }
        let _ = writeln!(text, "{table}");
        text
    }

    /// Everything as JSON.
    ///
    /// # Errors
    /// None that occurs.
    pub fn json(&self) -> std::io::Result<String> {
        let value = json!({
            "model": self.model,
            "choices": self.dataset.choices,
            "notes": self.dataset.notes,
            "views": self.outcomes,
            "mean": self.means(),
        });
        let mut bytes = Vec::new();
        write_json(&mut bytes, &value)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// A line for each view.
    fn csv(&self) -> String {
        let mut csv = "view,width,height,psnr,ssim,ssim_torchmetrics,ssim_valid,flip,largest\n".to_owned();
        for Outcome { name, width, height, measures } in self.outcomes {
            let Measures { ssim, ssim_torchmetrics, ssim_valid, flip, largest, .. } = measures;
            let name =
                if name.contains([',', '"']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name.clone() };
            let psnr = measures.decibels();
            let [reflected, valid] =
                [ssim_torchmetrics, ssim_valid].map(|ssim| ssim.map_or_else(String::new, |ssim| ssim.to_string()));
            let _ = writeln!(csv, "{name},{width},{height},{psnr},{ssim},{reflected},{valid},{flip},{largest}");
        }
        csv
    }

    /// A page with the worst views first: picture, photograph, difference.
    fn page(&self) -> String {
        let text = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
        let model = text(&self.model.display().to_string());
        let mut page = format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{model}</title>\n\
             <style>body{{font:16px sans-serif;margin:2em}}figure{{display:inline-block;margin:0 1em 1em 0}}\
             img{{max-width:30vw;background:#000}}td,th{{padding:0 1em 0 0;text-align:left}}</style></head><body>\n\
             <h1>{model}</h1>\n<table>\n"
        );
        for (subject, choice) in &self.dataset.choices {
            let _ = writeln!(page, "<tr><th>{subject}</th><td>{}</td></tr>", text(choice));
        }
        page.push_str("</table>\n");
        for note in &self.dataset.notes {
            let _ = writeln!(page, "<p>{}</p>", text(note));
        }
        let mean = sentence(&self.means());
        let _ = writeln!(page, "<h2>Mean of {}</h2>\n<p>{mean}</p>", self.outcomes.len());
        let mut outcomes: Vec<&Outcome> = self.outcomes.iter().collect();
        outcomes.sort_by(|a, b| a.measures.decibels().total_cmp(&b.measures.decibels()));
        for Outcome { name, measures, .. } in outcomes {
            let line = sentence(&Means::of(std::iter::once(measures)));
            let largest = measures.largest;
            let _ = writeln!(page, "<h2>{}</h2>\n<p>{line}</p>", text(name));
            let captions = ["picture", "photograph", &format!("difference, {:.0} of 255 being white", 255.0 * largest)];
            for (folder, caption) in PICTURES.iter().zip(captions) {
                let source = text(&format!("{folder}/{name}.png"));
                let _ = writeln!(
                    page,
                    "<figure><a href=\"{source}\"><img src=\"{source}\" alt=\"{caption}\" loading=\"lazy\"></a>\
                     <figcaption>{caption}</figcaption></figure>"
                );
            }
        }
        page.push_str("</body></html>\n");
        page
    }

    /// Writes `eval.json`, `eval.csv` and `index.html`.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        let path = folder.join("eval.json");
        let json = self.json().map_err(|source| Error::Io { path: path.clone(), source })?;
        write_file(&path, json.as_bytes())?;
        write_file(&folder.join("eval.csv"), self.csv().as_bytes())?;
        write_file(&folder.join("index.html"), self.page().as_bytes())
    }
}

/// The cells of a table's row. Measures that a small picture lacks are empty.
fn cells(name: &str, means: &Means) -> [String; 6] {
    let four = |value: f64| format!("{value:.4}");
    let [reflected, valid] =
        [means.ssim_torchmetrics, means.ssim_valid].map(|ssim| ssim.map_or_else(String::new, four));
    [name.to_owned(), format!("{:.2}", means.decibels()), four(means.ssim), reflected, valid, four(means.flip)]
}

fn sentence(means: &Means) -> String {
    let reflected = means.ssim_torchmetrics.map_or_else(String::new, |ssim| format!(", torchmetrics' {ssim:.4}"));
    let valid = means.ssim_valid.map_or_else(String::new, |ssim| format!(", pytorch-msssim's {ssim:.4}"));
    format!("PSNR {:.2} dB, SSIM {:.4}{reflected}{valid}, FLIP {:.4}", means.decibels(), means.ssim, means.flip)
}
