//! Scenes made of others.

use gaurast_scene::{GaussianShape, Scene};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// One Gaussian of a [`Scene`].
type Gaussian = ([f32; 3], GaussianShape, Vec<[f32; 3]>);

/// `scene` with each Gaussian changed by `change`, which is also given its index.
fn mapped(scene: &Scene, mut change: impl FnMut(usize, &mut Gaussian)) -> Scene {
    let mut made = Scene::with_capacity(scene.sh_degree(), scene.len());
    let coefficients = scene.sh().chunks(scene.sh_stride());
    let gaussians = scene.positions().iter().zip(scene.shapes()).zip(coefficients);
    for (index, ((position, shape), sh)) in gaussians.enumerate() {
        let mut gaussian = (*position, *shape, sh.to_vec());
        change(index, &mut gaussian);
        made.push(gaussian.0, gaussian.1, &gaussian.2);
    }
    made
}

/// `scene` with all positions mapped by `to`.
#[must_use]
pub fn moved(scene: &Scene, to: impl Fn([f32; 3]) -> [f32; 3]) -> Scene {
    mapped(scene, |_, gaussian| gaussian.0 = to(gaussian.0))
}

/// `scene` and then `other`, in an order that `seed` shuffles.
///
/// # Panics
/// If their spherical harmonics have different degrees.
#[must_use]
pub fn shuffled_with(scene: &Scene, other: &Scene, seed: u64) -> Scene {
    assert_eq!(scene.sh_degree(), other.sh_degree(), "one degree for all");
    let mut order: Vec<usize> = (0..scene.len() + other.len()).collect();
    order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    let mut made = Scene::with_capacity(scene.sh_degree(), order.len());
    let stride = scene.sh_stride();
    for index in order {
        let (from, index) = match index.checked_sub(scene.len()) {
            None => (scene, index),
            Some(index) => (other, index),
        };
        let sh = &from.sh()[index * stride..][..stride];
        made.push(from.positions()[index], from.shapes()[index], sh);
    }
    made
}

/// `scene` with all standard deviations multiplied by `factor`: more of it overlaps.
#[must_use]
pub fn scaled(scene: &Scene, factor: f32) -> Scene {
    mapped(scene, |_, (_, shape, _)| {
        shape.scale = shape.scale.map(|s| s * factor);
    })
}

/// `scene` with colours that are the same from everywhere: coefficients of degrees above 0 are zero, and still there.
#[must_use]
pub fn view_independent(scene: &Scene) -> Scene {
    mapped(scene, |_, (_, _, sh)| sh[1..].fill([0.0; 3]))
}

/// `scene` with `share` of its Gaussians, spread evenly, moved far away.
#[must_use]
pub fn partly_moved_away(scene: &Scene, share: f64) -> Scene {
    mapped(scene, |index, (position, _, _)| {
        let passed = |count: usize| (count as f64 * share).floor();
        if passed(index + 1) > passed(index) {
            position[1] += 1e5;
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes::synthetic;

    #[test]
    fn a_share_goes_away() {
        let scene = partly_moved_away(&synthetic(1, 1000), 0.25);
        let away = scene.positions().iter().filter(|p| p[1] > 1e4).count();
        assert_eq!(away, 250);
        let scene = synthetic(1, 10);
        assert_eq!(partly_moved_away(&scene, 0.0), scene);
        assert_eq!(scene.shapes()[3].scale[1] * 2.0, scaled(&scene, 2.0).shapes()[3].scale[1]);
        assert!(view_independent(&scene).sh().chunks(16).all(|sh| sh[1..] == [[0.0; 3]; 15]));
    }

    #[test]
    fn shuffling_keeps_every_gaussian() {
        let (a, b) = (synthetic(1, 30), synthetic(2, 20));
        let both = shuffled_with(&a, &b, 3);
        assert_eq!(both.len(), 50);
        assert_ne!(&both.positions()[..30], a.positions());
        let stride = a.sh_stride();
        for (number, position) in both.positions().iter().enumerate() {
            let find = |scene: &Scene| {
                let at = scene.positions().iter().position(|p| p == position)?;
                Some((scene.shapes()[at], scene.sh()[at * stride..][..stride].to_vec()))
            };
            let (shape, sh) = find(&a).or_else(|| find(&b)).unwrap();
            assert_eq!(both.shapes()[number], shape);
            assert_eq!(both.sh()[number * stride..][..stride], sh);
        }
        let up = moved(&a, |[x, y, z]| [x, y + 1.0, z]);
        assert_eq!(up.positions()[7][1], a.positions()[7][1] + 1.0);
        assert_eq!(up.shapes(), a.shapes());
    }
}
