//! The sizes of the pictures that 3DGS trains with, which are not those of its `cameras.json`.

use std::path::{Path, PathBuf};

use crate::cfg_args::CfgArgs;
use crate::photographs::{Photographs, SizeRule};

/// The names and the sizes of the photographs of a training.
#[derive(Debug)]
pub struct TrainingSize {
    /// The photographs, if they are there.
    photographs: Photographs,
    /// The photographs' sizes relative to those of the cameras, by the name of their folder.
    by_folder: SizeRule,
    /// The sizes in which they are trained relative to their own.
    trained: SizeRule,
}

impl TrainingSize {
    /// The sizes by the arguments of a training whose model is in `folder`.
    pub fn new(arguments: &CfgArgs, folder: &Path) -> Self {
        let images = arguments.text("images").unwrap_or("images");
        // The folders that come with data sets: images_4 has a quarter of the size.
        let divisor = images.rsplit_once('_').and_then(|(_, number)| number.parse::<f64>().ok());
        let by_folder = match divisor.filter(|divisor| *divisor >= 1.0) {
            Some(divisor) => SizeRule::Divided(divisor),
            None => SizeRule::Own,
        };
        let data = PathBuf::from(arguments.text("source_path").unwrap_or_default());
        let photographs = Photographs::of(&folder.join(data).join(images)).unwrap_or_default();
        let trained = SizeRule::Inria { resolution: arguments.number("resolution").unwrap_or(-1.0) };
        Self { photographs, by_folder, trained }
    }

    /// The size in which the photograph `name` is trained, of a camera with `size`.
    pub fn of(&self, name: &str, size: [u32; 2]) -> [u32; 2] {
        let photograph = self.photographs.find(name).and_then(|path| imagesize::size(path).ok());
        let own = photograph.map(|size| [size.width, size.height].map(|side| side as u32));
        self.trained.of(own.unwrap_or_else(|| self.by_folder.of(size)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(arguments: &str, size: [u32; 2]) -> [u32; 2] {
        let arguments = CfgArgs::parse(&format!("Namespace({arguments})"));
        TrainingSize::new(&arguments, Path::new("nowhere")).of("a", size)
    }

    #[test]
    fn sizes_are_those_of_the_folder_and_the_resolution() {
        let garden = [5187, 3361];
        assert_eq!(of("images='images_4', resolution=-1", garden), [1297, 840]);
        assert_eq!(of("images='images', resolution=-1", garden), [1600, 1036]);
        assert_eq!(of("images='images', resolution=8", garden), [648, 420]);
        assert_eq!(of("images='my_images', resolution=-1", [40, 30]), [40, 30]);
        assert_eq!(of("sh_degree=3", garden), [1600, 1036]);
    }

    #[test]
    fn photographs_that_are_there_give_their_size() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("data/images_2/a.png");
        std::fs::create_dir_all(gaurast_picture::folder(&path)).expect("a folder");
        let picture = gaurast_picture::Picture { width: 7, height: 5, pixels: vec![[0.0; 4]; 35] };
        gaurast_picture::write(&path, &picture, None).expect("written");
        let arguments = CfgArgs::parse("Namespace(source_path='data', images='images_2', resolution=-1)");
        let size = TrainingSize::new(&arguments, folder.path());
        assert_eq!(size.of("a.JPG", [20, 10]), [7, 5]);
        assert_eq!(size.of("b.JPG", [20, 10]), [10, 5]);
    }
}
