//! Vertices for scenes.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::Vertex;

/// A random number generator with the same sequence on all machines.
pub fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// Random triangles within the view volume, each vertex with its own depth, `w` and colour.
pub fn soup(seed: u64, triangles: usize) -> Vec<Vertex> {
    let mut rng = rng(seed);
    let mut vertices = Vec::with_capacity(3 * triangles);
    for _ in 0..triangles {
        let center = [0; 2].map(|_| rng.random_range(-0.6..0.6f32));
        for _ in 0..3 {
            let x = center[0] + rng.random_range(-0.39..0.39f32);
            let y = center[1] + rng.random_range(-0.39..0.39f32);
            let z = rng.random_range(0.05..0.95f32);
            let w = rng.random_range(1.0..3.0f32);
            vertices.push(Vertex {
                position: [x * w, y * w, z * w, w],
                color: [0; 4].map(|_| rng.random_range(0.0..1.0f32)),
            });
        }
    }
    vertices
}

/// The same triangles without perspective.
pub fn flat_soup(seed: u64, triangles: usize) -> Vec<Vertex> {
    let mut vertices = soup(seed, triangles);
    for vertex in &mut vertices {
        let w = vertex.position[3];
        vertex.position = vertex.position.map(|coordinate| coordinate / w);
        vertex.position[3] = 1.0;
    }
    vertices
}

/// Random points within the view volume.
pub fn points(seed: u64, count: usize) -> Vec<Vertex> {
    let mut rng = rng(seed);
    (0..count)
        .map(|_| Vertex {
            position: [rng.random_range(-0.9..0.9), rng.random_range(-0.9..0.9), rng.random_range(0.0..1.0), 1.0],
            color: [0; 4].map(|_| rng.random_range(0.0..1.0f32)),
        })
        .collect()
}

/// A rectangle at one depth in one colour, as a triangle list.
pub fn rectangle([x0, y0, x1, y1]: [f32; 4], z: f32, color: [f32; 4]) -> Vec<Vertex> {
    [[x0, y0], [x1, y0], [x0, y1], [x0, y1], [x1, y0], [x1, y1]]
        .map(|[x, y]| Vertex { position: [x, y, z, 1.0], color })
        .to_vec()
}

/// The whole target at one depth in one colour.
pub fn whole(z: f32, color: [f32; 4]) -> Vec<Vertex> {
    rectangle([-1.0, -1.0, 1.0, 1.0], z, color)
}

/// A zigzag across the target, as a triangle strip of `count` vertices.
pub fn zigzag(seed: u64, count: usize) -> Vec<Vertex> {
    let mut rng = rng(seed);
    (0..count)
        .map(|index| {
            let x = -0.9 + 1.8 * index as f32 / (count - 1) as f32;
            let side = if index % 2 == 0 { -1.0 } else { 1.0 };
            Vertex {
                position: [x, side * rng.random_range(0.2..0.9f32), 0.5, 1.0],
                color: [0; 4].map(|_| rng.random_range(0.0..1.0f32)),
            }
        })
        .collect()
}
