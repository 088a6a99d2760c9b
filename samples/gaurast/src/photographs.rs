//! The photographs of a data set, by name, and the sizes in which they are compared.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use gaurast_picture::PictureFormat;

/// The width above which 3DGS makes photographs smaller.
const INRIA_MAX_WIDTH: f64 = 1600.0;

/// The pictures of a folder and the folders in it.
#[derive(Debug, Default)]
pub struct Photographs {
    /// By path within the folder, without extension.
    files: BTreeMap<String, PathBuf>,
}

impl Photographs {
    /// The photographs in `folder`.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn of(folder: &Path) -> std::io::Result<Self> {
        let mut photographs = Self::default();
        photographs.add(folder, "")?;
        Ok(photographs)
    }

    fn add(&mut self, folder: &Path, prefix: &str) -> std::io::Result<()> {
        for entry in folder.read_dir()? {
            let path = entry?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if path.is_dir() {
                self.add(&path, &format!("{prefix}{name}/"))?;
            } else if PictureFormat::of(&path).is_ok() {
                self.files.insert(prefix.to_owned() + &stem(&name), path);
            }
        }
        Ok(())
    }

    /// The photograph of a camera, whose name may have a folder and an extension: the one with this path, or else the only
    /// one with this file name.
    pub fn find(&self, name: &str) -> Option<&Path> {
        let name = stem(name);
        if let Some(path) = self.files.get(&name) {
            return Some(path);
        }
        let mut same = self.files.iter().filter(|(path, _)| file_name(path) == file_name(&name));
        match (same.next(), same.next()) {
            (Some((_, path)), None) => Some(path),
            _ => None,
        }
    }

    /// The names of the photographs that are not among `used`.
    pub fn others(&self, used: &[&Path]) -> Vec<String> {
        let is_other = |(_, path): &(&String, &PathBuf)| !used.contains(&path.as_path());
        self.files.iter().filter(is_other).map(|(name, _)| name.clone()).collect()
    }

    /// Returns true if there is no photograph.
    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }
}

/// A photograph's name without its extension and a leading `./`.
pub fn stem(name: &str) -> String {
    let name = name.trim_start_matches("./");
    let known = PictureFormat::of(Path::new(name)).is_ok();
    match name.rsplit_once('.') {
        Some((stem, _)) if known => stem.to_owned(),
        _ => name.to_owned(),
    }
}

/// A name without its folders.
pub fn file_name(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

/// The rule by which a photograph's size becomes that of the compared pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SizeRule {
    /// The photograph's own.
    Own,
    /// The photograph's divided by this, rounded.
    Divided(f64),
    /// 3DGS's, whose argument `resolution` is a divisor of 1, 2, 4 or 8, another width, or -1 for at most 1600 columns.
    Inria { resolution: f64 },
}

impl SizeRule {
    /// The size in which a photograph of `size` is compared.
    pub fn of(self, size: [u32; 2]) -> [u32; 2] {
        let own = size.map(f64::from);
        let sides = match self {
            Self::Own => own,
            Self::Divided(divisor) => own.map(|side| libm::round(side / divisor)),
            // As Python rounds: a half to the even number.
            Self::Inria { resolution } if [1.0, 2.0, 4.0, 8.0].contains(&resolution) => {
                own.map(|side| libm::rint(side / resolution))
            }
            Self::Inria { resolution } => {
                let divisor =
                    if resolution == -1.0 { (own[0] / INRIA_MAX_WIDTH).max(1.0) } else { own[0] / resolution };
                own.map(|side| libm::trunc(side / divisor))
            }
        };
        sides.map(|side| side.max(1.0) as u32)
    }

    /// The rule in words.
    pub fn describe(self) -> String {
        match self {
            Self::Own => "the photographs'".to_owned(),
            Self::Divided(divisor) => format!("the photographs' divided by {divisor}, by PIL's bicubic filter"),
            Self::Inria { resolution: -1.0 } => {
                "as 3DGS trains: the photographs', or 1600 columns if they have more, by PIL's bicubic filter"
                    .to_owned()
            }
            Self::Inria { resolution } => {
                format!("as 3DGS trains with a resolution of {resolution}, by PIL's bicubic filter")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_those_of_3dgs() {
        let inria = |resolution: f64, size: [u32; 2]| SizeRule::Inria { resolution }.of(size);
        // int(orig / (orig_w / 1600.0)) of Python.
        assert_eq!(inria(-1.0, [5187, 3361]), [1600, 1036]);
        assert_eq!(inria(-1.0, [1297, 840]), [1297, 840]);
        assert_eq!(inria(800.0, [1297, 840]), [800, 518]);
        assert_eq!(inria(2.0, [1297, 841]), [648, 420]);
        assert_eq!(inria(4.0, [1297, 842]), [324, 210]);
        assert_eq!(SizeRule::Divided(4.0).of([1297, 842]), [324, 211]);
        assert_eq!(SizeRule::Own.of([3, 1]), [3, 1]);
    }

    #[test]
    fn photographs_are_found_by_name() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["a.png", "left/1.JPG", "right/1.JPG", "left/2.JPG", "notes.txt"] {
            let path = folder.path().join(name);
            std::fs::create_dir_all(gaurast_picture::folder(&path)).expect("a folder");
            std::fs::write(path, "").expect("written");
        }
        let photographs = Photographs::of(folder.path()).expect("read");
        let found = |name: &str| photographs.find(name).and_then(|path| path.strip_prefix(folder.path()).ok());
        assert_eq!(found("./a.jpg"), Some(Path::new("a.png")));
        assert_eq!(found("images/a"), Some(Path::new("a.png")));
        assert_eq!(found("left/1.jpg"), Some(Path::new("left/1.JPG")));
        assert_eq!(found("1.jpg"), None);
        assert_eq!(found("2"), Some(Path::new("left/2.JPG")));
        let used = photographs.find("a").expect("there");
        assert_eq!(photographs.others(&[used]), ["left/1", "left/2", "right/1"]);
    }
}
