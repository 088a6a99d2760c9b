//! The views that are measured, of all that a model was trained with.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::str::FromStr;

use crate::photographs::{file_name, stem};

/// The share of the views that nerfstudio trains with.
const TRAIN_FRACTION: f64 = 0.9;

/// A choice of views, from all of them in the order of their names.
#[derive(Clone, Debug, PartialEq)]
pub enum Split {
    All,
    /// The first, and every n-th one after it, as 3DGS and Mip-NeRF 360 leave them out.
    Every(usize),
    /// The views that nerfstudio leaves out if it trains with this share.
    Fraction(f64),
    /// Views by name; the text says where the names are from.
    Names {
        names: BTreeSet<String>,
        from: String,
    },
    /// A file with a name in each line.
    File(PathBuf),
}

impl FromStr for Split {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (kind, value) = text.split_once(':').unwrap_or((text, ""));
        match kind {
            "all" => Ok(Self::All),
            "every" => {
                let count = if value.is_empty() { Some(8) } else { value.parse().ok() };
                count.filter(|count| *count > 0).map(Self::Every).ok_or("every:N is a number of at least 1")
            }
            "fraction" => {
                let share = if value.is_empty() { Some(TRAIN_FRACTION) } else { value.parse().ok() };
                let is_share = |share: &f64| (0.0..1.0).contains(share);
                share.filter(is_share).map(Self::Fraction).ok_or("fraction:F is at least 0 and less than 1")
            }
            _ => Ok(Self::File(PathBuf::from(text))),
        }
    }
}

impl Split {
    /// nerfstudio's default.
    pub fn of_nerfstudio() -> Self {
        Self::Fraction(TRAIN_FRACTION)
    }

    /// The split with a file's names read.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn read(self) -> Result<Self, (PathBuf, std::io::Error)> {
        let Self::File(path) = self else {
            return Ok(self);
        };
        match std::fs::read_to_string(&path) {
            Ok(text) => {
                let names = text.lines().map(str::trim).filter(|line| !line.is_empty()).map(stem).collect();
                Ok(Self::Names { names, from: path.display().to_string() })
            }
            Err(source) => Err((path, source)),
        }
    }

    /// The indices of the chosen views, of which `names` are sorted.
    ///
    /// # Errors
    /// The names that no view has.
    pub fn choose(&self, names: &[String]) -> Result<Vec<usize>, Vec<String>> {
        let count = names.len();
        Ok(match self {
            Self::All => (0..count).collect(),
            Self::Every(step) => (0..count).step_by(*step).collect(),
            Self::Fraction(share) => {
                let trained = libm::ceil(count as f64 * share) as usize;
                // numpy's linspace of whole numbers, from the first view to the last one.
                let step = count.saturating_sub(1) as f64 / trained.saturating_sub(1).max(1) as f64;
                let mut of_training: BTreeSet<usize> = (0..trained).map(|at| (at as f64 * step) as usize).collect();
                if trained > 1 {
                    of_training.insert(count - 1);
                }
                (0..count).filter(|at| !of_training.contains(at)).collect()
            }
            Self::Names { names: wanted, .. } => {
                let stems: Vec<String> = names.iter().map(|name| stem(name)).collect();
                let is =
                    |wanted: &str, name: &str| wanted == name || file_name(wanted) == name || file_name(name) == wanted;
                let missing = wanted.iter().filter(|wanted| !stems.iter().any(|name| is(wanted, name)));
                let missing: Vec<String> = missing.cloned().collect();
                if !missing.is_empty() {
                    return Err(missing);
                }
                (0..count).filter(|at| wanted.iter().any(|wanted| is(wanted, &stems[*at]))).collect()
            }
            Self::File(_) => Vec::new(),
        })
    }

    /// The split in words.
    pub fn describe(&self) -> String {
        match self {
            Self::All => "all".to_owned(),
            Self::Every(8) => "every 8th by name, which 3DGS and Mip-NeRF 360 leave out of training".to_owned(),
            Self::Every(count) => format!("one of {count} by name, beginning with the first"),
            Self::Fraction(share) => format!("those that nerfstudio leaves out of training with a share of {share}"),
            Self::Names { from, .. } => format!("those that {from} lists"),
            Self::File(path) => path.display().to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(split: &str, count: usize) -> Vec<usize> {
        let names: Vec<String> = (0..count).map(|at| format!("images/{at:03}.JPG")).collect();
        split.parse::<Split>().expect(split).choose(&names).expect(split)
    }

    #[test]
    fn splits_are_those_of_the_trainers() {
        assert_eq!(chosen("all", 3), [0, 1, 2]);
        assert_eq!(chosen("every", 17), [0, 8, 16]);
        assert_eq!(chosen("every:5", 11), [0, 5, 10]);
        // numpy: np.setdiff1d(np.arange(n), np.linspace(0, n - 1, math.ceil(0.9 * n), dtype=int))
        assert_eq!(chosen("fraction", 12), [10]);
        assert_eq!(chosen("fraction:0.9", 45), [10, 21, 32, 43]);
        assert_eq!(chosen("fraction:0.5", 7), [1, 3, 5]);
        for bad in ["every:0", "every:x", "fraction:1", "fraction:-0.1"] {
            assert!(bad.parse::<Split>().is_err(), "{bad}");
        }
    }

    #[test]
    fn lists_name_views_with_or_without_folder_and_extension() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("test.txt");
        std::fs::write(&path, "b.png\n\n./images/c\n").expect("written");
        let split = path.to_str().expect("text").parse::<Split>().expect("a file").read().expect("read");
        let names = ["images/a.jpg", "images/b.jpg", "images/c.jpg"].map(str::to_owned);
        assert_eq!(split.choose(&names), Ok(vec![1, 2]));
        assert_eq!(split.choose(&names[..2]), Err(vec!["images/c".to_owned()]));
    }
}
