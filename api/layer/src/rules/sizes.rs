//! The sizes of Gaussians beside the distances between them.

/// The least number of Gaussians that tell anything.
const LEAST: usize = 128;
/// The number of Gaussians whose nearest neighbours are looked for.
const LOOKED_AT: usize = 64;
/// A distance to the nearest neighbour, in standard deviations, at which a scene is dust.
const APART: f32 = 32.0;

/// Positions of Gaussians, and their greatest standard deviations.
#[derive(Debug, Default)]
pub(crate) struct Sizes {
    positions: Vec<[f32; 3]>,
    sizes: Vec<f32>,
}

impl Sizes {
    /// Adds a Gaussian.
    pub(crate) fn add(&mut self, position: [f32; 3], scale: [f32; 3]) {
        self.positions.push(position);
        self.sizes.push(scale.into_iter().fold(0.0, f32::max));
    }

    /// Reports whether the square roots of scales fit the distances of neighbours, and scales are far too small: how many
    /// of them the nearest neighbour is away, in the middle.
    pub(crate) fn look_like_variances(&self) -> Option<f32> {
        let number = self.positions.len();
        if number < LEAST {
            return None;
        }
        let looked_at = (0..LOOKED_AT).map(|index| index * number / LOOKED_AT);
        let distances = looked_at.clone().map(|index| self.nearest(index));
        let distance = middle(distances.collect());
        let size = middle(looked_at.map(|index| self.sizes[index]).collect());
        let root = size.sqrt();
        let fits = root >= distance / 3.0 && root <= distance * 3.0;
        (size > 0.0 && size * APART < distance && fits).then(|| distance / size)
    }

    /// The distance of the nearest neighbour.
    fn nearest(&self, index: usize) -> f32 {
        let own = self.positions[index];
        let squares = self.positions.iter().enumerate().filter(|(other, _)| *other != index).map(|(_, other)| {
            let [x, y, z] = std::array::from_fn(|axis| own[axis] - other[axis]);
            x * x + y * y + z * z
        });
        squares.fold(f32::INFINITY, f32::min).sqrt()
    }
}

/// The number in the middle of some.
fn middle(mut numbers: Vec<f32>) -> f32 {
    numbers.sort_by(f32::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(0.0)
}
