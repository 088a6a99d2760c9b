//! Features and limits: what a device must say of itself, and draws up to what it says.

use ash::vk;
use gaurast::vk::{
    PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as Features,
    PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST as Properties,
};
use gaurast_oracle::oracle::OracleInstance;
use gaurast_testkit::Gpu;

use super::chapter::Chapter;
use super::input::vertices;
use super::scenes::{Gaussian, SceneBuffers, ball, cloud, dense, front, many};
use crate::draw::{Call, Draw};
use crate::features::FEATURES;
use crate::program::Program;

/// What a physical device says.
fn ask(gpu: &Gpu) -> (Features<'static>, Properties<'static>) {
    let (mut features, mut properties) = (Features::default(), Properties::default());
    let mut all_features = vk::PhysicalDeviceFeatures2::default().push_next(&mut features);
    let mut all_properties = vk::PhysicalDeviceProperties2::default().push_next(&mut properties);
    // SAFETY: the physical device is the instance's, and has the extension of these structures.
    unsafe {
        gpu.instance().get_physical_device_features2(gpu.physical_device(), &mut all_features);
        gpu.instance().get_physical_device_properties2(gpu.physical_device(), &mut all_properties);
    }
    (features.p_next, properties.p_next) = (std::ptr::null_mut(), std::ptr::null_mut());
    (Features { _marker: std::marker::PhantomData, ..features }, properties)
}

/// A check of what a device says.
type Check = fn(&Gpu) -> Result<(), String>;

/// Says what is wrong unless something holds.
fn must(holds: bool, message: impl Into<String>) -> Result<(), String> {
    if holds { Ok(()) } else { Err(message.into()) }
}

pub(super) fn limits(chapter: &mut Chapter<'_>) {
    chapter.program("features", || {
        Program::check(|gpu| {
            let (features, _) = ask(gpu);
            for (name, offered) in FEATURES {
                let value = offered(&features);
                must(value <= vk::TRUE, format!("{name} is {value}, no truth value"))?;
            }
            must(features.gaussian_primitive_topology == vk::TRUE, "gaussianPrimitiveTopology is not offered")?;
            must(
                features.resolve_gaussian_indices == vk::FALSE || features.resolve_fragment_shader == vk::TRUE,
                "resolveGaussianIndices is offered without resolveFragmentShader",
            )
        })
    });
    let claims: [(&str, Check); 5] = [
        ("tileSize", |gpu| {
            let vk::Extent2D { width, height } = ask(gpu).1.tile_size;
            must(width > 0 && height > 0, format!("{width} x {height} pixels"))
        }),
        ("maxSphericalHarmonicsDegree", |gpu| {
            let degree = ask(gpu).1.max_spherical_harmonics_degree;
            must((3..=4).contains(&degree), format!("{degree}, not 3 or 4"))?;
            let attributes = gpu.limits().max_vertex_input_attributes;
            let least = if degree == 4 { 29 } else { 24 };
            must(attributes >= least, format!("{attributes} attributes, not at least {least}"))
        }),
        ("gaussianSampleCounts", |gpu| {
            let (features, properties) = ask(gpu);
            let counts = properties.gaussian_sample_counts;
            let (one, four) = (vk::SampleCountFlags::TYPE_1, vk::SampleCountFlags::TYPE_4);
            must(counts.contains(one), format!("{counts:?} has not one sample"))?;
            match features.gaussian_multisample {
                vk::FALSE => must(counts == one, format!("{counts:?} without gaussianMultisample")),
                _ => must(counts.contains(four), format!("{counts:?} has not four samples")),
            }
        }),
        ("maxGaussiansPerDraw", |gpu| {
            let most = ask(gpu).1.max_gaussians_per_draw;
            must(most >= (1 << 24) - 1, format!("{most}, not at least 2^24 - 1"))
        }),
        ("maxGaussiansPerSet", |gpu| {
            let Properties { max_gaussians_per_draw: draw, max_gaussians_per_set: set, .. } = ask(gpu).1;
            must(set >= draw, format!("{set}, less than maxGaussiansPerDraw, which is {draw}"))
        }),
    ];
    for (name, check) in claims {
        chapter.program(format!("{name}.value"), move || Program::check(check));
    }
    draws(chapter);
    large(chapter);
}

/// Small Gaussians all over the picture, the last of which are in front.
fn grains(count: usize) -> SceneBuffers {
    many(count, |index| Gaussian {
        position: grain(index, count),
        scale: [0.02; 3],
        opacity: 0.6,
        sh: vec![[(index % 5) as f32 - 2.0, (index % 3) as f32 - 1.0, (index % 7) as f32 - 3.0]],
        ..ball()
    })
}

/// The place of one of many: columns fill from the left, and come nearer.
fn grain(index: usize, count: usize) -> [f32; 3] {
    let column = index as f32 / count as f32;
    let row = (index * 193 % 1021) as f32 / 1021.0;
    [4.0 * column - 2.0, 3.2 * row - 1.6, 6.0 - 2.0 * column]
}

fn draws(chapter: &mut Chapter<'_>) {
    chapter.add("maxGaussiansPerDraw.vertices_70000", || Draw::new(grains(70_000)));
    chapter.add("maxGaussiansPerDraw.instances_70000", || of_instances(70_000));
    chapter.program("maxGaussiansPerSet.draws_of_70000", || {
        let draw = Draw { merged: true, ..Draw::new(grains(70_000)) };
        Program::pass(draw, |_, commands| {
            commands.gaussian_set(|| {
                for first in (0..70_000).step_by(1000) {
                    commands.draw(first..first + 1000);
                }
            });
        })
    });
    for (name, size) in [("wide", [4096, 24]), ("high", [24, 4096]), ("large", [1280, 720])] {
        chapter.add(format!("tileSize.{name}"), move || {
            let [width, height] = size.map(|side| side as f32);
            let focal_length = [width * 0.8, height * 0.8];
            let camera = front().focal_length(focal_length).principal_point([width / 2.0, height / 2.0]);
            Draw { size, behind: [0.1, 0.2, 0.3, 0.4], ..Draw::new(cloud(581, 300, 0)).seen_by(camera) }
        });
    }
    for degree in [3, 4] {
        chapter.add(format!("maxSphericalHarmonicsDegree.degree_{degree}"), move || Draw::new(dense(582, degree)));
    }
    for samples in [1, 2, 4, 8, 16, 32, 64] {
        chapter.add(format!("gaussianSampleCounts.samples_{samples}"), move || Draw {
            samples,
            behind: [0.1, 0.2, 0.3, 0.4],
            ..Draw::new(dense(583, 0))
        });
    }
}

/// Instances of one Gaussian, each at a place of its own.
fn of_instances(count: u32) -> Draw {
    let placed = (0..count).map(|index| {
        let [x, y, z] = grain(index as usize, count as usize);
        OracleInstance {
            matrix: [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z]],
            opacity: 0.5 + 0.5 * (index % 2) as f32,
        }
    });
    let one = many(1, |_| Gaussian { position: [0.0; 3], scale: [0.02; 3], ..ball() });
    Draw {
        instances: Some((vk::VertexInputRate::INSTANCE, placed.collect())),
        calls: vec![Call::Draw { vertices: [0, 1], instances: [0, count] }],
        ..Draw::new(one)
    }
}

/// The largest draws, which run if they are asked for.
fn large(chapter: &mut Chapter<'_>) {
    chapter.add_large("tileSize.4096x4096", || {
        let camera = front().focal_length([3200.0; 2]).principal_point([2048.0; 2]);
        Draw { size: [4096, 4096], ..Draw::new(cloud(584, 200, 0)).seen_by(camera) }
    });
    for (name, count) in [("2000000", 2_000_000), ("16777215", (1 << 24) - 1)] {
        chapter.add_large(format!("maxGaussiansPerDraw.vertices_{name}"), move || Draw {
            calls: vec![vertices(0, count)],
            ..Draw::new(grains(count as usize))
        });
        chapter.add_large(format!("maxGaussiansPerDraw.instances_{name}"), move || of_instances(count));
    }
}
