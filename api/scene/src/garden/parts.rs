//! The parts of the garden. Each function paints exactly `count` splats.

use std::f64::consts::TAU;

use glam::DVec3;

use super::brush::{Brush, Splat};
use super::directions::{facing, spread};
use super::light::{leaf, matte, mirror, sky as sky_colour, smooth, sun};

/// The radius of the pond, whose centre is the origin and whose water has height 0.
const POND: f64 = 1.75;

/// The radius of the meadow.
const MEADOW: f64 = 42.0;

/// A tree: its position, its height, and its leaves' colours in shade and in light.
struct Tree {
    x: f64,
    z: f64,
    height: f64,
    dark: DVec3,
    bright: DVec3,
}

const GREEN: [DVec3; 2] = [DVec3::new(0.07, 0.17, 0.05), DVec3::new(0.34, 0.50, 0.12)];
const OLIVE: [DVec3; 2] = [DVec3::new(0.13, 0.17, 0.05), DVec3::new(0.55, 0.55, 0.16)];
const ROSE: [DVec3; 2] = [DVec3::new(0.40, 0.12, 0.20), DVec3::new(0.98, 0.58, 0.68)];
const AMBER: [DVec3; 2] = [DVec3::new(0.36, 0.11, 0.02), DVec3::new(0.96, 0.52, 0.12)];

const fn tree(x: f64, z: f64, height: f64, [dark, bright]: [DVec3; 2]) -> Tree {
    Tree { x, z, height, dark, bright }
}

const TREES: [Tree; 12] = [
    tree(-2.9, -1.5, 3.0, ROSE),
    tree(3.3, -2.6, 3.6, AMBER),
    tree(-5.6, -4.4, 4.4, GREEN),
    tree(0.9, -5.6, 3.9, OLIVE),
    tree(6.4, -6.0, 4.8, GREEN),
    tree(-2.6, -8.4, 4.6, AMBER),
    tree(4.2, -10.5, 5.2, ROSE),
    tree(-8.8, -9.8, 5.4, OLIVE),
    tree(-13.0, -15.0, 6.5, GREEN),
    tree(11.5, -13.5, 6.2, OLIVE),
    tree(-4.5, -18.0, 6.5, GREEN),
    tree(9.0, -22.0, 7.5, AMBER),
];

/// The ground's height above the water.
fn ground(x: f64, z: f64) -> f64 {
    let from_centre = libm::hypot(x, z);
    let bank = smooth((from_centre - POND + 0.25) / 1.4);
    let hills = 0.16 * libm::sin(0.7 * x + 0.4) * libm::cos(0.6 * z - 0.8)
        + 0.5 * smooth((from_centre - 6.0) / 26.0) * libm::sin(0.21 * x + 0.17 * z)
        + 0.05 * libm::sin(2.3 * x - 1.1 * z);
    -0.25 + bank * (0.37 + hills)
}

fn ground_normal(x: f64, z: f64) -> DVec3 {
    let step = 0.02;
    let slope = |dx: f64, dz: f64| (ground(x + dx, z + dz) - ground(x - dx, z - dz)) / (2.0 * step);
    DVec3::new(-slope(step, 0.0), 1.0, -slope(0.0, step)).normalize()
}

/// The share of the sunlight that the trees let through to the ground.
fn shade(x: f64, z: f64) -> f64 {
    TREES.iter().fold(1.0, |open, tree| {
        // The crown's shadow lies opposite the sun.
        let reach = 0.62 * tree.height / sun().y;
        let (dx, dz) = (x - (tree.x - sun().x * reach), z - (tree.z - sun().z * reach));
        let along = (dx * sun().x + dz * sun().z) / libm::hypot(sun().x, sun().z);
        let across = dx * dx + dz * dz - along * along;
        let size = 0.30 * tree.height;
        let stretched = 0.45 * along;
        let distance = (across + stretched * stretched).max(0.0) / (size * size);
        open * (1.0 - 0.75 * libm::exp(-distance))
    })
}

/// The colour at a distance, which fades into the light over the horizon.
fn haze(colour: DVec3, position: DVec3) -> DVec3 {
    let distance = position.length();
    let along = DVec3::new(position.x, 0.06 * distance, position.z).normalize_or(DVec3::Y);
    colour.lerp(0.92 * sky_colour(along), smooth((distance - 5.0) / 42.0) * 0.9)
}

/// Paints the sky: large soft splats on a far dome.
pub(super) fn sky(brush: &mut Brush, count: usize) {
    let radius = 90.0;
    // A quarter of the sphere's points would lie far below the horizon.
    let all = count + count / 3;
    let spacing = (4.0 * std::f64::consts::PI / all.max(1) as f64).sqrt();
    for i in 0..count {
        let direction = spread(i, all);
        let cloud =
            libm::sin(7.0 * direction.x + 3.0 * direction.z) * libm::sin(16.0 * direction.y + 2.5 * direction.x);
        let low = smooth(direction.y / 0.08) * (1.0 - smooth((direction.y - 0.15) / 0.3));
        let colour = sky_colour(direction) + DVec3::new(0.16, 0.09, 0.09) * (cloud * low);
        let mut splat = Splat::new(direction * radius, radius * spacing * 0.62, colour);
        splat.rotation = facing(direction, 0.0);
        splat.scale.z *= 0.1;
        splat.opacity = brush.even(0.93, 0.98);
        brush.paint(&splat);
    }
}

/// Paints ground and grass: denser near the pond, larger far away.
pub(super) fn meadow(brush: &mut Brush, count: usize) {
    for i in 0..count {
        let (sin, cos) = libm::sincos(brush.even(0.0, TAU));
        // The same number at every scale of distance from the pond's bank.
        let reach = libm::pow(brush.even(0.0, 1.0), 1.3);
        let from_centre = (POND - 0.05) * libm::pow(MEADOW / (POND - 0.05), reach);
        let (x, z) = (from_centre * cos, from_centre * sin);
        let (height, normal) = (ground(x, z), ground_normal(x, z));
        let size = 0.013 * libm::pow(from_centre.max(2.0), 0.8);
        let patch = 0.5 + 0.5 * libm::sin(1.7 * x + libm::sin(1.3 * z)) * libm::cos(1.1 * z - 0.6 * x);
        let grass = DVec3::new(0.17, 0.27, 0.07).lerp(DVec3::new(0.38, 0.38, 0.12), patch);
        let albedo = grass * brush.even(0.75, 1.2);
        let open = shade(x, z);
        let wet = 1.0 - 0.4 * (1.0 - smooth(height / 0.07));
        let base = DVec3::new(x, height, z);
        let blade = i % 3 != 0 && height > 0.03;
        let splat = if blade {
            let lean = DVec3::new(brush.normal(0.3), 1.0, brush.normal(0.3)).normalize();
            let length = size * brush.even(0.8, 1.9);
            let tip = brush.even(0.9, 1.45);
            let lit = leaf(albedo * tip, (normal + lean).normalize(), open);
            let position = base + lean * length;
            let mut splat = Splat::new(position, size * 0.16, haze(lit * wet, position));
            splat.rotation = facing(lean, 0.0);
            splat.scale.z = length;
            splat.opacity = brush.even(0.7, 0.95);
            splat
        } else {
            let lit = matte(albedo * 0.55, normal, open);
            let mut splat = Splat::new(base, size * 1.9, haze(lit * wet, base));
            splat.rotation = facing(normal, brush.even(0.0, TAU));
            splat.scale *= DVec3::new(1.0, brush.even(0.6, 1.0), 0.18);
            splat.opacity = 0.97;
            splat
        };
        brush.paint(&splat);
    }
}

/// Paints flowers in patches: a few petals each.
pub(super) fn flowers(brush: &mut Brush, count: usize) {
    const COLOURS: [DVec3; 5] = [
        DVec3::new(0.95, 0.93, 0.88),
        DVec3::new(0.95, 0.72, 0.12),
        DVec3::new(0.86, 0.16, 0.15),
        DVec3::new(0.56, 0.32, 0.82),
        DVec3::new(0.96, 0.45, 0.62),
    ];
    const PETALS: usize = 6;
    let mut centre = DVec3::ZERO;
    let mut colour = COLOURS[0];
    let mut head = DVec3::ZERO;
    for i in 0..count {
        if i % (40 * PETALS) == 0 {
            let (sin, cos) = libm::sincos(brush.even(0.0, TAU));
            centre = DVec3::new(cos, 0.0, sin) * brush.even(POND + 0.5, 6.5);
            colour = COLOURS[(brush.even(0.0, 5.0) as usize).min(4)];
        }
        if i % PETALS == 0 {
            let (x, z) = (centre.x + brush.normal(0.35), centre.z + brush.normal(0.35));
            head = DVec3::new(x, ground(x, z).max(0.03) + brush.even(0.06, 0.15), z);
        }
        let middle = i % PETALS == 0;
        let (sin, cos) = libm::sincos(TAU * (i % PETALS) as f64 / (PETALS - 1) as f64);
        let offset = if middle { 0.0 } else { 0.016 };
        let position = head + DVec3::new(cos, brush.even(-0.2, 0.3), sin) * offset;
        let albedo = if middle { COLOURS[1] } else { colour };
        let normal = DVec3::new(0.5 * cos, 1.0, 0.5 * sin).normalize();
        let lit = leaf(albedo, normal, shade(head.x, head.z)) * 1.1;
        let mut splat = Splat::new(position, 0.009, haze(lit, position));
        splat.rotation = facing(normal, 0.0);
        splat.scale.z *= 0.35;
        brush.paint(&splat);
    }
}

/// Paints trees: near ones get most of the leaves.
pub(super) fn trees(brush: &mut Brush, count: usize) {
    let weight = |tree: &Tree| 1.0 / (1.0 + 0.10 * (tree.x * tree.x + (tree.z + 4.0) * (tree.z + 4.0))).sqrt();
    let total: f64 = TREES.iter().map(weight).sum();
    let mut left = count;
    for (i, tree) in TREES.iter().enumerate() {
        let share = (count as f64 * weight(tree) / total) as usize;
        let share = if i + 1 == TREES.len() { left } else { share.min(left) };
        left -= share;
        grow(brush, tree, share);
    }
}

fn grow(brush: &mut Brush, tree: &Tree, count: usize) {
    let root = DVec3::new(tree.x, ground(tree.x, tree.z) - 0.05, tree.z);
    let height = tree.height;
    let bend = DVec3::new(brush.normal(0.05), 0.0, brush.normal(0.05));
    let trunk = |t: f64| root + DVec3::Y * (0.62 * height * t) + bend * (height * t * t);
    // Clumps of leaves around the trunk's end.
    let clumps: Vec<(DVec3, f64)> = (0..16)
        .map(|i| {
            let direction = spread(i, 16);
            let offset = direction * DVec3::new(0.27, 0.20, 0.27) * height * brush.even(0.7, 1.15);
            let centre = trunk(1.0) + DVec3::Y * (0.07 * height) + offset;
            (centre, height * brush.even(0.10, 0.155))
        })
        .collect();
    let crown = trunk(1.0) + DVec3::Y * (0.08 * height);
    let bark = count / 14;
    for _ in 0..bark {
        let t = brush.even(0.0, 1.0);
        let (sin, cos) = libm::sincos(brush.even(0.0, TAU));
        let outwards = DVec3::new(cos, 0.0, sin);
        let radius = height * (0.042 - 0.026 * t) * (1.0 + 0.9 * libm::exp(-9.0 * t));
        let position = trunk(t) + outwards * radius;
        let albedo = DVec3::new(0.30, 0.22, 0.16) * brush.even(0.6, 1.15);
        let lit = matte(albedo, outwards, 0.75 - 0.5 * t);
        let mut splat = Splat::new(position, height * 0.007, haze(lit, position));
        splat.rotation = facing(outwards, 0.0);
        splat.scale *= DVec3::new(0.9, 3.2, 0.4);
        brush.paint(&splat);
    }
    let leaf_size = height * 0.0075 * libm::pow(20_000.0 / count.max(1) as f64, 0.33).clamp(0.8, 2.2);
    for i in bark..count {
        let (centre, radius) = clumps[i % clumps.len()];
        let direction = brush.direction();
        // Most leaves are near the clump's surface.
        let out = libm::pow(brush.even(0.0, 1.0), 0.3) + brush.normal(0.06);
        let position = centre + direction * DVec3::new(1.0, 0.8, 1.0) * (radius * out);
        let outwards = ((position - crown) / (0.3 * height)).clamp_length_max(1.0);
        let normal = (0.6 * direction + 0.7 * outwards + 0.35 * brush.direction()).normalize_or(DVec3::Y);
        let open = smooth(0.38 + 0.45 * out * outwards.length() + 0.3 * direction.dot(sun()))
            * (0.75 + 0.25 * smooth(0.5 + 0.6 * outwards.dot(sun())));
        let albedo = tree.dark.lerp(tree.bright, brush.even(0.35, 1.0) * (0.4 + 0.6 * open));
        let lit = leaf(albedo, normal, open);
        let mut splat = Splat::new(position, leaf_size, haze(lit, position));
        splat.rotation = facing(normal, brush.even(0.0, TAU));
        splat.scale *= DVec3::new(1.5, 0.85, 0.3) * brush.even(0.7, 1.35);
        splat.opacity = brush.even(0.75, 0.96);
        brush.paint(&splat);
    }
}

/// Paints the pond: a dark bowl under clear water that mirrors sun and sky, and a few lily pads. The upside-down knot
/// that [`knot`] paints is seen through the water as the knot's reflection.
pub(super) fn pond(brush: &mut Brush, count: usize) {
    let (pads, bowl) = (count / 14, count / 4);
    for i in 0..count {
        let splat = if i < pads {
            lily_pad(brush, i)
        } else if i < pads + bowl {
            // The lower half of a sphere.
            let direction = spread(bowl + i - pads, 2 * bowl);
            let depth = smooth(-direction.y);
            let colour = DVec3::new(0.10, 0.13, 0.10).lerp(DVec3::new(0.03, 0.08, 0.11), depth);
            let position = direction * DVec3::new(POND + 0.45, 3.0, POND + 0.45);
            let mut splat = Splat::new(position - 0.05 * DVec3::Y, 0.10, colour);
            splat.rotation = facing(direction, 0.0);
            splat.scale.z *= 0.2;
            splat
        } else {
            water(brush)
        };
        brush.paint(&splat);
    }
}

/// A piece of a lily pad, around one of a few places.
fn lily_pad(brush: &mut Brush, index: usize) -> Splat {
    let place = spread(index % 14, 14) * (POND * 0.85);
    let position = DVec3::new(place.x, 0.012, place.z) + brush.on_disc(0.11);
    let albedo = DVec3::new(0.16, 0.34, 0.12) * brush.even(0.8, 1.2);
    let mut splat = Splat::new(position, 0.022, matte(albedo, DVec3::Y, 0.8));
    splat.rotation = facing(DVec3::Y, brush.even(0.0, TAU));
    splat.scale.z *= 0.2;
    splat
}

/// A piece of the water's surface.
fn water(brush: &mut Brush) -> Splat {
    let position = brush.on_disc(POND + 0.25);
    let ripple = DVec3::new(
        0.05 * libm::sin(9.0 * position.x + 5.0 * position.z),
        1.0,
        0.05 * libm::sin(8.0 * position.z - 4.0 * position.x),
    )
    .normalize();
    let mut splat = Splat::new(position, 0.08, DVec3::new(0.10, 0.16, 0.24));
    splat.rotation = facing(ripple, brush.even(0.0, TAU));
    splat.scale.z *= 0.12;
    splat.opacity = 0.045;
    let glow = DVec3::new(sun().x, 0.12, sun().z).normalize();
    splat.shine = vec![
        (mirror(sun(), ripple), DVec3::new(0.22, 0.14, 0.08)),
        (mirror(glow, ripple), DVec3::new(0.08, 0.05, 0.05)),
        (mirror(DVec3::Y, ripple), DVec3::new(0.02, 0.12, 0.34)),
    ];
    splat
}

/// Paints small warm lights over the pond.
pub(super) fn fireflies(brush: &mut Brush, count: usize) {
    for _ in 0..count {
        let mut position = brush.on_disc(POND + 1.6);
        position.y = brush.even(0.15, 1.7);
        let mut splat = Splat::new(position, brush.even(0.008, 0.02), DVec3::new(1.0, 0.86, 0.45));
        splat.opacity = brush.even(0.35, 0.8);
        brush.paint(&splat);
    }
}

/// Paints a torus knot of polished metal, whose tone changes along its course, and its mirror image.
pub(super) fn knot(brush: &mut Brush, count: usize) {
    let image = count / 5;
    paint_knot(brush, count - image, false);
    paint_knot(brush, image, true);
}

/// The knot's centre line at `t`, from 0 to 2 pi.
fn course(t: f64) -> DVec3 {
    let (angle, around) = (2.0 * t, 3.0 * t);
    let radius = 0.62 + 0.26 * libm::cos(around);
    let (sin, cos) = libm::sincos(angle);
    DVec3::new(radius * cos, 1.14 + radius * sin, 0.30 * libm::sin(around))
}

fn paint_knot(brush: &mut Brush, count: usize, mirrored: bool) {
    const TONES: [DVec3; 3] =
        [DVec3::new(0.80, 0.52, 0.20), DVec3::new(0.76, 0.30, 0.30), DVec3::new(0.20, 0.50, 0.56)];
    const TUBE: f64 = 0.135;
    let horizon = DVec3::new(sun().x, 0.1, sun().z).normalize();
    let size = 1.45 * (13.0 * TUBE / count.max(1) as f64).sqrt().min(0.2);
    for i in 0..count {
        let t = TAU * (i as f64 + brush.even(0.0, 1.0)) / count as f64;
        let (here, ahead) = (course(t), course(t + 1e-3));
        let tangent = (ahead - here).normalize();
        let side = tangent.cross(DVec3::Y + 0.01 * DVec3::X).normalize_or(DVec3::X);
        // Multiples of the golden angle leave no gaps.
        let (sin, cos) = libm::sincos(2.399_963 * i as f64 % TAU);
        let normal = side * cos + tangent.cross(side) * sin;
        let tone = 3.0 * (t / TAU);
        let (from, part) = (tone as usize % 3, smooth(tone - libm::trunc(tone)));
        let metal = TONES[from].lerp(TONES[(from + 1) % 3], part);
        let mut splat = Splat::new(here + normal * TUBE, size, DVec3::ZERO);
        splat.opacity = 0.97;
        splat.colour = metal * (matte(DVec3::splat(0.42), normal, 0.9) + DVec3::splat(0.02));
        // The sun, the bright horizon around it, and the sky above, as seen in the surface.
        splat.shine = vec![
            (mirror(sun(), normal), metal * DVec3::new(1.5, 1.2, 0.9)),
            (mirror(horizon, normal), metal * DVec3::new(0.7, 0.5, 0.4)),
            (mirror(DVec3::Y, normal), metal * DVec3::new(0.45, 0.6, 0.9)),
        ];
        let mut outwards = normal;
        if mirrored {
            splat.position.y *= -1.0;
            outwards.y *= -1.0;
            for (axis, _) in &mut splat.shine {
                axis.y *= -1.0;
            }
        }
        splat.rotation = facing(outwards, brush.even(0.0, TAU));
        splat.scale.z *= 0.15;
        brush.paint(&splat);
    }
}
