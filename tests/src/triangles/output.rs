//! What a scene leaves behind.

use ash::vk;

/// The images that a scene draws, in the order in which it made them.
#[derive(Clone, Debug, Default)]
pub struct Output {
    /// Those images.
    pub pictures: Vec<Picture>,
}

impl Output {
    /// Adds the pictures of another output, whose names get a prefix.
    pub fn add(&mut self, prefix: &str, other: Self) {
        self.pictures
            .extend(other.pictures.into_iter().map(|picture| Picture {
                name: format!("{prefix} {}", picture.name),
                ..picture
            }));
    }

    /// Whether some picture shows anything: not all of its texels are alike.
    pub fn shows_something(&self) -> bool {
        self.pictures.iter().any(|picture| {
            let texel = texel_size(picture.format) as usize;
            let first = &picture.bytes[..texel];
            picture
                .bytes
                .chunks_exact(texel)
                .any(|other| other != first)
        })
    }
}

/// One image: an attachment, or one sample of it.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Which one it is.
    pub name: String,
    /// Its format.
    pub format: vk::Format,
    /// Width and height.
    pub size: [u32; 2],
    /// Its texels, row by row from the top.
    pub bytes: Vec<u8>,
}

impl Picture {
    /// Its texels as values of `T`, which must have their size.
    ///
    /// # Panics
    /// If it hasn't.
    pub fn texels<T: bytemuck::Pod>(&self) -> Vec<T> {
        assert_eq!(size_of::<T>(), texel_size(self.format) as usize);
        bytemuck::pod_collect_to_vec(&self.bytes)
    }
}

/// Bytes of a texel when copied to a buffer.
///
/// # Panics
/// For formats that no scene draws to.
pub fn texel_size(format: vk::Format) -> u32 {
    use vk::Format as F;
    match format {
        F::R8_UNORM | F::R8_UINT | F::S8_UINT => 1,
        F::R5G6B5_UNORM_PACK16 | F::R8G8_UNORM | F::D16_UNORM | F::R16_SFLOAT | F::R16_UINT => 2,
        F::R8G8B8A8_UNORM
        | F::R8G8B8A8_SNORM
        | F::R8G8B8A8_SRGB
        | F::R8G8B8A8_UINT
        | F::R8G8B8A8_SINT
        | F::B8G8R8A8_UNORM
        | F::B8G8R8A8_SRGB
        | F::A2B10G10R10_UNORM_PACK32
        | F::B10G11R11_UFLOAT_PACK32
        | F::R16G16_SFLOAT
        | F::R32_SFLOAT
        | F::R32_UINT
        | F::R32_SINT
        | F::X8_D24_UNORM_PACK32
        | F::D32_SFLOAT => 4,
        F::R16G16B16A16_SFLOAT | F::R16G16B16A16_UNORM | F::R32G32_SFLOAT | F::R32G32_UINT => 8,
        F::R32G32B32A32_SFLOAT | F::R32G32B32A32_UINT => 16,
        _ => panic!("no scene draws to {format:?}"),
    }
}
