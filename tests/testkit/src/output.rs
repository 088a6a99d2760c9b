//! The pictures that a scene draws.

use ash::vk;

use crate::resource::texel_size;

/// The images that a scene draws, in the order in which it made them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Output {
    /// The pictures, in the order in which they were made.
    pub pictures: Vec<Picture>,
}

impl Output {
    /// Adds the pictures of another output, whose names get a prefix.
    pub fn add(&mut self, prefix: &str, other: Self) {
        self.pictures.extend(
            other.pictures.into_iter().map(|picture| Picture { name: format!("{prefix} {}", picture.name), ..picture }),
        );
    }

    /// True if some picture shows anything: its texels are not all equal.
    pub fn shows_something(&self) -> bool {
        self.pictures.iter().any(|picture| {
            let texel = texel_size(picture.format) as usize;
            let first = &picture.bytes[..texel];
            picture.bytes.chunks_exact(texel).any(|other| other != first)
        })
    }
}

/// One image: an attachment, or one sample of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// The picture's name.
    pub name: String,
    /// Its format.
    pub format: vk::Format,
    /// Width and height.
    pub size: [u32; 2],
    /// Its texels, row by row from the top.
    pub bytes: Vec<u8>,
}

impl Picture {
    /// The texels as values of `T`, which must have the size of a texel.
    ///
    /// # Panics
    /// If the sizes differ.
    pub fn texels<T: bytemuck::Pod>(&self) -> Vec<T> {
        assert_eq!(size_of::<T>(), texel_size(self.format) as usize);
        bytemuck::pod_collect_to_vec(&self.bytes)
    }
}
