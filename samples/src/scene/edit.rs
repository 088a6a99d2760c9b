//! Scenes made of others.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::Scene;

impl Scene {
    /// The scene with all positions mapped by `to`.
    #[must_use]
    pub fn moved(mut self, to: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        for position in &mut self.positions {
            *position = to(*position);
        }
        self
    }

    /// The scene and then `other`, in an order that `seed` shuffles.
    ///
    /// # Panics
    /// If their spherical harmonics have different degrees.
    #[must_use]
    pub fn shuffled_with(&self, other: &Self, seed: u64) -> Self {
        assert_eq!(self.sh_degree, other.sh_degree, "one degree for all");
        let mut order: Vec<usize> = (0..self.len() + other.len()).collect();
        order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
        let mut scene = Self::with_capacity(self.sh_degree, order.len());
        let stride = self.sh_stride();
        for index in order {
            let (from, index) = match index.checked_sub(self.len()) {
                None => (self, index),
                Some(index) => (other, index),
            };
            let sh = &from.sh[index * stride..][..stride];
            scene.push(from.positions[index], from.shapes[index], sh);
        }
        scene
    }

    /// The scene with all standard deviations multiplied by `factor`: more of it overlaps.
    #[must_use]
    pub fn scaled(mut self, factor: f32) -> Self {
        for shape in &mut self.shapes {
            shape.scale = shape.scale.map(|s| s * factor);
        }
        self
    }

    /// The scene with colours that are the same from everywhere: coefficients of degrees above 0 are zero, and still there.
    #[must_use]
    pub fn plain(mut self) -> Self {
        let stride = self.sh_stride();
        for coefficients in self.sh.chunks_mut(stride) {
            coefficients[1..].fill([0.0; 3]);
        }
        self
    }

    /// The scene with `share` of its Gaussians, spread evenly, far away from where it was.
    #[must_use]
    pub fn partly_away(mut self, share: f64) -> Self {
        for (index, position) in self.positions.iter_mut().enumerate() {
            let passed = |count: usize| (count as f64 * share).floor();
            if passed(index + 1) > passed(index) {
                position[1] += 1e5;
            }
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_goes_away() {
        let scene = Scene::benchmark(1, 1000).partly_away(0.25);
        let away = scene.positions().iter().filter(|p| p[1] > 1e4).count();
        assert_eq!(away, 250);
        let scene = Scene::benchmark(1, 10);
        assert_eq!(scene.clone().partly_away(0.0), scene);
        assert_eq!(
            scene.shapes()[3].scale[1] * 2.0,
            scene.scaled(2.0).shapes()[3].scale[1]
        );
    }

    #[test]
    fn shuffling_keeps_every_gaussian() {
        let (a, b) = (Scene::benchmark(1, 30), Scene::benchmark(2, 20));
        let both = a.shuffled_with(&b, 3);
        assert_eq!(both.len(), 50);
        assert_ne!(&both.positions[..30], &a.positions[..]);
        let stride = a.sh_stride();
        for (number, position) in both.positions.iter().enumerate() {
            let find = |scene: &Scene| {
                let at = scene.positions.iter().position(|p| p == position)?;
                Some((scene.shapes[at], scene.sh[at * stride..][..stride].to_vec()))
            };
            let (shape, sh) = find(&a).or_else(|| find(&b)).unwrap();
            assert_eq!(both.shapes[number], shape);
            assert_eq!(both.sh[number * stride..][..stride], sh);
        }
        let up = a.clone().moved(|[x, y, z]| [x, y + 1.0, z]);
        assert_eq!(up.positions[7][1], a.positions[7][1] + 1.0);
        assert_eq!(up.shapes, a.shapes);
    }
}
