//! Changes that must not affect a picture, or must affect it in a known way: the number of threads, ways of drawing the
//! same Gaussians, parts of the target, formats of targets and backgrounds.

use ash::vk;
use gaurast::vk::GaussianCameraGAURAST;
use gaurast_runner::{Case, simd_levels};
use gaurast_testkit::{
    Buffer, Commands, Formats, GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Pass, PassObject, Settings,
    Target, TargetOptions, over,
};
use gaurast_tests::compare::{Limits, assert_contract};
use gaurast_tests::oracle::{OracleCamera, OracleState, render_bounded};
use gaurast_tests::scenes::{self, SceneBuffers};
use half::f16;

/// The picture's size; not a multiple of a tile.
const SIZE: [u32; 2] = [203, 139];

fn camera() -> OracleCamera {
    scenes::camera(SIZE[0], SIZE[1])
}

fn rect(x: i32, y: i32, width: u32, height: u32) -> vk::Rect2D {
    vk::Rect2D { offset: vk::Offset2D { x, y }, extent: vk::Extent2D { width, height } }
}

/// The Gaussians of a scene in `range`.
fn part(scene: &SceneBuffers, range: std::ops::Range<usize>) -> SceneBuffers {
    let triples = (scene.degree as usize + 1).pow(2);
    SceneBuffers {
        positions: scene.positions[range.clone()].to_vec(),
        scales: scene.scales[range.clone()].to_vec(),
        rotations: scene.rotations[range.clone()].to_vec(),
        opacities: scene.opacities[range.clone()].to_vec(),
        sh: scene.sh[triples * range.start..triples * range.end].to_vec(),
        degree: scene.degree,
    }
}

/// The Gaussians of both scenes, in this order.
fn joined(mut a: SceneBuffers, b: &SceneBuffers) -> SceneBuffers {
    assert_eq!(a.degree, b.degree);
    a.positions.extend(&b.positions);
    a.scales.extend(&b.scales);
    a.rotations.extend(&b.rotations);
    a.opacities.extend(&b.opacities);
    a.sh.extend(&b.sh);
    a
}

/// A device, a scene on it, and a pipeline that draws it into a 32-bit float target of [`SIZE`].
struct Bench {
    gpu: Gpu,
    pipeline: GaussianPipeline,
    scene: GaussianScene,
    camera: GaussianCameraGAURAST<'static>,
}

impl Bench {
    fn new(scene: &SceneBuffers) -> Self {
        Self::with(scene, &Settings::default(), &GaussianOptions::new(scene.degree))
    }

    fn with(scene: &SceneBuffers, settings: &Settings, options: &GaussianOptions) -> Self {
        let gpu = Gpu::embedded(settings).expect("a device");
        Self {
            pipeline: GaussianPipeline::new(&gpu, options),
            scene: GaussianScene::new(&gpu, scene),
            camera: camera().to_vulkan(),
            gpu,
        }
    }

    fn target(&self) -> Target {
        Target::floats(&self.gpu, SIZE)
    }

    /// The texels after `record` in a pass that clears to zero, with the scene bound.
    fn draw(&self, record: impl FnOnce(&Commands)) -> Vec<[f32; 4]> {
        self.draw_to(&self.target(), &Pass::clear([0.0; 4]), record)
    }

    fn draw_to<T: bytemuck::AnyBitPattern>(
        &self,
        target: &Target,
        pass: &Pass,
        record: impl FnOnce(&Commands),
    ) -> Vec<T> {
        self.gpu.run(|commands| {
            commands.pass(target, pass, || {
                self.scene.bind(commands, &self.pipeline, &self.camera);
                record(commands);
            });
        });
        assert_eq!(self.gpu.messages(), []);
        target.read()
    }

    /// The whole scene, with one `vkCmdDraw`.
    fn whole(&self) -> Vec<[f32; 4]> {
        self.draw(|commands| commands.draw(0..self.scene.count))
    }
}

/// A scene of trained shapes with some difficult ones, and with equal depths.
fn scene() -> SceneBuffers {
    joined(scenes::cloud(21, 3000, 1), &scenes::awkward(22, 100, 1))
}

#[track_caller]
fn assert_same(a: &[[f32; 4]], b: &[[f32; 4]]) {
    assert_eq!(a.len(), b.len());
    if let Some(index) = (0..a.len()).find(|&i| a[i] != b[i]) {
        let (x, y) = (index % SIZE[0] as usize, index / SIZE[0] as usize);
        panic!("({x}, {y}) is {:?} and {:?}", a[index], b[index]);
    }
}

#[track_caller]
fn assert_close(a: &[[f32; 4]], b: &[[f64; 4]], tolerance: f64) {
    assert_eq!(a.len(), b.len());
    let worst = a.iter().zip(b).map(|(a, b)| distance(*a, *b)).fold(0.0, f64::max);
    assert!(worst <= tolerance, "{worst:e} exceeds {tolerance:e}");
}

/// The greatest difference of a channel.
fn distance(a: [f32; 4], b: [f64; 4]) -> f64 {
    let channels = a.iter().zip(b).map(|(a, b)| (f64::from(*a) - b).abs());
    channels.fold(0.0, f64::max)
}

#[gaurast_runner::test(each = simd_levels())]
fn threads_change_nothing(case: &Case) {
    let scene = scene();
    let draw = |threads| {
        let settings = Settings { simd: Some(case.variant()), threads: Some(threads), ..Settings::default() };
        Bench::with(&scene, &settings, &GaussianOptions::new(scene.degree)).whole()
    };
    let one = draw(1);
    for threads in [2, 3, 8] {
        assert_same(&one, &draw(threads));
    }
    assert!(one.iter().filter(|rgba| rgba[3] > 0.5).count() > one.len() / 10);
}

#[gaurast_runner::test]
fn drawing_again_changes_nothing() {
    let bench = Bench::new(&scene());
    let first = bench.whole();
    for _ in 0..3 {
        assert_same(&first, &bench.whole());
    }
}

#[gaurast_runner::test]
fn indices_that_name_every_gaussian_are_a_draw_without_indices() {
    let bench = Bench::new(&scene());
    let indices: Vec<u32> = (0..bench.scene.count).collect();
    let indices = Buffer::of(&bench.gpu, &indices);
    let indexed = bench.draw(|commands| {
        commands.indices(&indices, 0, vk::IndexType::UINT32);
        commands.draw_indexed(0..bench.scene.count, 0);
    });
    assert_same(&bench.whole(), &indexed);
}

#[gaurast_runner::test]
fn the_order_of_indices_matters_for_ties_only() {
    // All depths differ, so sorting removes the effect of the indices' order.
    let mut scene = scenes::cloud(23, 2000, 0);
    scene.positions.sort_by(|a, b| a[2].total_cmp(&b[2]));
    scene.positions.dedup_by_key(|position| position[2]);
    let count = scene.positions.len();
    let scene = part(&scene, 0..count);
    let bench = Bench::new(&scene);
    assert_ne!(count % 1009, 0, "what follows is a permutation");
    let shuffled: Vec<u32> = (0..count).map(|i| (i * 1009 % count) as u32).collect();
    let indices = Buffer::of(&bench.gpu, &shuffled);
    let indexed = bench.draw(|commands| {
        commands.indices(&indices, 0, vk::IndexType::UINT32);
        commands.draw_indexed(0..bench.scene.count, 0);
    });
    assert_same(&bench.whole(), &indexed);

    // All depths are equal, so the order of the indices is the order of drawing.
    let mut flat = part(&scene, 0..200);
    flat.positions.iter_mut().for_each(|p| {
        let scale = 5.0 / p[2];
        *p = [p[0] * scale, p[1] * scale, 5.0];
    });
    let backwards: Vec<u32> = (0..200).rev().collect();
    let bench = Bench::new(&flat);
    let indices = Buffer::of(&bench.gpu, &backwards);
    let indexed = bench.draw(|commands| {
        commands.indices(&indices, 0, vk::IndexType::UINT32);
        commands.draw_indexed(0..200, 0);
    });
    let reversed = (0..200).rev().map(|i| part(&flat, i..i + 1));
    let reversed = reversed.reduce(|a, b| joined(a, &b)).expect("some");
    assert_same(&Bench::new(&reversed).whole(), &indexed);
    assert_ne!(bench.whole(), indexed);
}

#[gaurast_runner::test]
fn a_part_of_the_buffers_is_a_scene_of_its_own() {
    let scene = scene();
    let bench = Bench::new(&scene);
    let (first, count) = (700, 1500);
    let expected = Bench::new(&part(&scene, first..first + count)).whole();
    let (first, count) = (first as u32, count as u32);

    let with_first = bench.draw(|commands| commands.draw(first..first + count));
    assert_same(&expected, &with_first);

    let indices: Vec<u32> = (0..bench.scene.count).collect();
    let indices = Buffer::of(&bench.gpu, &indices);
    let with_first_index = bench.draw(|commands| {
        commands.indices(&indices, 0, vk::IndexType::UINT32);
        commands.draw_indexed(first..first + count, 0);
    });
    assert_same(&expected, &with_first_index);
    let with_offset = bench.draw(|commands| {
        commands.indices(&indices, 0, vk::IndexType::UINT32);
        commands.draw_indexed(0..count, first as i32);
    });
    assert_same(&expected, &with_offset);
    let with_both = bench.draw(|commands| {
        commands.indices(&indices, 0, vk::IndexType::UINT32);
        commands.draw_indexed(first + 300..first + 300 + count, -300);
    });
    assert_same(&expected, &with_both);
    let indirect = Buffer::of(&bench.gpu, &[[count, 1, first, 0_u32]]);
    let with_indirect = bench.draw(|commands| commands.draw_indirect(&indirect, 1));
    assert_same(&expected, &with_indirect);
}

#[gaurast_runner::test]
fn instances_draw_every_gaussian_again() {
    // Each instance is the whole scene. Ties are in the order of instances first.
    let scene = scene();
    let twice = joined(scene.clone(), &scene);
    let expected = Bench::new(&twice).whole();
    let bench = Bench::new(&scene);
    let drawn = bench.draw(|commands| commands.draw_instances(0..bench.scene.count, 5..5 + 2));
    assert_same(&expected, &drawn);
}

#[gaurast_runner::test]
fn attributes_advance_by_instance() {
    // Positions, scales and rotations advance by vertex, opacities and colours by instance.
    let shapes = scenes::cloud(24, 300, 0);
    let looks = scenes::cloud(25, 4, 0);
    let mut mixed = shapes.clone();
    mixed.opacities.clone_from(&looks.opacities);
    mixed.sh.clone_from(&looks.sh);
    let options = GaussianOptions { looks_by_instance: true, ..GaussianOptions::new(0) };
    // The first instance has index 1.
    let mut expected = SceneBuffers::default();
    for instance in 1..4 {
        let mut copy = shapes.clone();
        copy.opacities.fill(looks.opacities[instance]);
        copy.sh.fill(looks.sh[instance]);
        expected = joined(expected, &copy);
    }
    let bench = Bench::with(&mixed, &Settings::default(), &options);
    let drawn = bench.draw(|commands| commands.draw_instances(0..300, 1..1 + 3));
    assert_same(&Bench::new(&expected).whole(), &drawn);
}

/// Small instances share groups of the device; the picture is that of the same Gaussians by vertex.
#[gaurast_runner::test(each = simd_levels())]
fn small_instances_are_the_gaussians_that_they_have(case: &Case) {
    let settings = Settings { simd: Some(case.variant()), ..Settings::default() };
    for (count, instances) in [(1_u64, 700_u32), (2, 300), (7, 90), (100, 6), (128, 5), (129, 4), (300, 2)] {
        let shapes = scenes::cloud(count, count as usize, 1);
        let looks = scenes::cloud(count + 1, 1 + instances as usize, 1);
        let mut mixed = shapes.clone();
        mixed.opacities.clone_from(&looks.opacities);
        mixed.sh.clone_from(&looks.sh);
        let mut expected = SceneBuffers { degree: 1, ..SceneBuffers::default() };
        for instance in 1..=instances as usize {
            let look = part(&looks, instance..instance + 1);
            let copies = || std::iter::repeat_n(look.sh.as_slice(), count as usize);
            let copy = SceneBuffers {
                opacities: vec![look.opacities[0]; count as usize],
                sh: copies().flatten().copied().collect(),
                ..shapes.clone()
            };
            expected = joined(expected, &copy);
        }
        let expected = Bench::with(&expected, &settings, &GaussianOptions::new(1)).whole();
        let options = GaussianOptions { looks_by_instance: true, ..GaussianOptions::new(1) };
        let bench = Bench::with(&mixed, &settings, &options);
        let vertices = count as u32;
        let drawn = bench.draw(|commands| commands.draw_instances(0..vertices, 1..1 + instances));
        assert_same(&expected, &drawn);
        // The same through indices that count from 9.
        let indices: Vec<u32> = (0..vertices).map(|vertex| vertex + 9).collect();
        let indices = Buffer::of(&bench.gpu, &indices);
        let indexed = bench.draw(|commands| {
            commands.indices(&indices, 0, vk::IndexType::UINT32);
            let (device, raw) = commands.raw();
            // SAFETY: see the crate.
            unsafe { device.cmd_draw_indexed(raw, vertices, instances, 0, -9, 1) };
        });
        assert_same(&expected, &indexed);
    }
}

/// Vertices beyond the buffers cost nothing, and are warned of once.
#[gaurast_runner::test]
fn vertices_beyond_the_buffers_draw_nothing() {
    let scene = scenes::cloud(26, 1200, 0);
    let bench = Bench::new(&scene);
    let expected = bench.whole();
    let indirect = Buffer::of(&bench.gpu, &[[u32::MAX, 1, 0, 0]]);
    let target = bench.target();
    bench.gpu.run(|commands| {
        commands.pass(&target, &Pass::clear([0.0; 4]), || {
            bench.scene.bind(commands, &bench.pipeline, &bench.camera);
            commands.draw_indirect(&indirect, 1);
        });
    });
    assert_same(&expected, &target.read());
    let texts = bench.gpu.message_texts();
    let [text] = &*texts else { panic!("{texts:?}") };
    assert!(text.contains("leaves out 4294966095 of them"), "{text}");
}

#[gaurast_runner::test]
fn empty_draws_draw_nothing() {
    let bench = Bench::new(&scene());
    let background = [0.25, 0.5, 0.75, 1.0];
    let drawn: Vec<[f32; 4]> = bench.draw_to(&bench.target(), &Pass::clear(background), |c| {
        c.draw(0..0);
        c.draw_instances(0..bench.scene.count, 0..0);
    });
    assert_same(&vec![background; drawn.len()], &drawn);
}

#[gaurast_runner::test]
fn what_is_not_covered_keeps_its_colour_even_where_draws_replace() {
    let scene = scenes::cloud(31, 12, 0);
    let bench = Bench::new(&scene);
    let background = [0.25, 0.5, 0.75, 1.0];
    let drawn: Vec<[f32; 4]> = bench.draw_to(&bench.target(), &Pass::clear(background), |c| {
        c.draw(0..bench.scene.count);
    });
    let reference = render_bounded(&scene.as_oracle(), &camera(), &OracleState::default());
    let (mut kept, mut replaced) = (0, 0);
    for (pixel, color) in drawn.iter().enumerate() {
        if reference.outcomes(pixel).all(|outcome| *outcome == [0.0; 4]) {
            assert_eq!(*color, background, "pixel {pixel} is not covered");
            kept += 1;
        } else {
            replaced += usize::from(*color != background);
        }
    }
    assert!(kept > 0 && replaced > 0, "{kept} kept, {replaced} replaced");
}

#[gaurast_runner::test]
fn the_viewport_says_where_the_camera_s_picture_is() {
    let scene = scene();
    let bench = Bench::new(&scene);
    let reference = render_bounded(&scene.as_oracle(), &camera(), &OracleState::default());
    let [width, height] = SIZE;
    for [x, y] in [[0, 0], [16, 32], [7, 5], [64, 64]] {
        let size = [width + 70, height + 70];
        let target = Target::floats(&bench.gpu, size);
        let corner = [x as f32, y as f32];
        let whole_size = [width as f32, height as f32];
        let draw = |viewport: [f32; 4]| -> Vec<[f32; 4]> {
            bench.draw_to(&target, &Pass::clear([0.0; 4]), |commands| {
                commands.viewport(viewport, [0.0, 1.0]);
                commands.draw(0..bench.scene.count);
            })
        };
        let drawn = draw([corner[0], corner[1], whole_size[0], whole_size[1]]);
        let rows = drawn.chunks(size[0] as usize).skip(y as usize).take(height as usize);
        let within: Vec<[f32; 4]> = rows.flat_map(|row| row[x as usize..][..width as usize].to_vec()).collect();
        let name = format!("viewport at {x}, {y}");
        assert_contract(&name, &within, &reference, Limits::ENVELOPE_ONLY);

        // A viewport with negative height covers the same pixels, and the camera's picture is not flipped.
        let flipped = draw([corner[0], corner[1] + whole_size[1], whole_size[0], -whole_size[1]]);
        assert!(drawn == flipped, "{name}");
    }
}

#[gaurast_runner::test]
fn the_scissor_cuts_and_changes_nothing_else() {
    let bench = Bench::new(&scene());
    let whole = bench.whole();
    let (width, height) = (SIZE[0] as i32, SIZE[1] as i32);
    for scissor in [
        rect(0, 0, 1, 1),
        rect(13, 7, 64, 64),
        rect(31, 95, 100, 9),
        rect(width - 5, height - 3, 1000, 1000),
        rect(50, 50, 0, 10),
    ] {
        let background = [0.25, 0.5, 0.75, 1.0];
        let cut: Vec<[f32; 4]> = bench.draw_to(&bench.target(), &Pass::clear(background), |commands| {
            let (offset, extent) = (scissor.offset, scissor.extent);
            commands.scissor([offset.x, offset.y], [extent.width, extent.height]);
            commands.draw(0..bench.scene.count);
        });
        assert_same(&inside(&whole, scissor, background), &cut);
    }
}

#[gaurast_runner::test]
fn the_render_area_cuts_and_changes_nothing_else() {
    let bench = Bench::new(&scene());
    let whole = bench.whole();
    for area in [rect(16, 16, 64, 32), rect(3, 61, 150, 70), rect(202, 138, 1, 1)] {
        let target = bench.target();
        let background = [0.25, 0.5, 0.75, 1.0];
        let none = bench.draw_to(&target, &Pass::clear(background), |_| ());
        assert_same(&vec![background; whole.len()], &none);
        let pass = Pass { area: Some(area), ..Pass::clear([0.0; 4]) };
        let cut: Vec<[f32; 4]> = bench.draw_to(&target, &pass, |commands| {
            commands.draw(0..bench.scene.count);
        });
        assert_same(&inside(&whole, area, background), &cut);
    }
}

/// `image` inside `rect`, and `outside` everywhere else.
fn inside(image: &[[f32; 4]], rect: vk::Rect2D, outside: [f32; 4]) -> Vec<[f32; 4]> {
    let within = |at: usize, offset: i32, length: u32| {
        let at = at as i64 - i64::from(offset);
        (0..i64::from(length)).contains(&at)
    };
    let pixel = |(index, rgba): (usize, &[f32; 4])| {
        let (x, y) = (index % SIZE[0] as usize, index / SIZE[0] as usize);
        let is_in = within(x, rect.offset.x, rect.extent.width) && within(y, rect.offset.y, rect.extent.height);
        if is_in { *rgba } else { outside }
    };
    image.iter().enumerate().map(pixel).collect()
}

#[gaurast_runner::test]
fn blending_composites_over_the_background() {
    let scene = scene();
    let alone = Bench::new(&scene).whole();
    let options = GaussianOptions { blend: vec![over()], ..GaussianOptions::new(scene.degree) };
    let bench = Bench::with(&scene, &Settings::default(), &options);
    for background in [[0.2, 0.4, 0.6, 1.0], [0.0; 4], [3.0, 0.1, 0.05, 0.3]] {
        let blended = bench.draw_to(&bench.target(), &Pass::clear(background), |commands| {
            commands.draw(0..bench.scene.count);
        });
        let expected: Vec<[f64; 4]> =
            alone.iter().map(|rgba| composite(rgba.map(f64::from), background.map(f64::from))).collect();
        // The error of one product and one sum of numbers up to 3.
        assert_close(&blended, &expected, 4e-7);
    }
}

/// Premultiplied `front` over `behind`.
fn composite(front: [f64; 4], behind: [f64; 4]) -> [f64; 4] {
    std::array::from_fn(|c| front[c] + (1.0 - front[3]) * behind[c])
}

#[gaurast_runner::test]
fn draws_of_a_pass_are_composited_in_their_order() {
    // Each draw is sorted by itself: a later one is over an earlier one at any depth.
    let scene = scenes::cloud(26, 3000, 1);
    let options = GaussianOptions { blend: vec![over()], ..GaussianOptions::new(scene.degree) };
    let bench = Bench::with(&scene, &Settings::default(), &options);
    let background = [0.1, 0.2, 0.3, 0.4];
    let parts = [0..1000_usize, 1000..1003, 1003..2500, 2500..3000];
    // All outcomes of every pixel, because a few pixels are undecidable in one of the draws.
    let nothing = vec![vec![background.map(f64::from)]; (SIZE[0] * SIZE[1]) as usize];
    let expected = parts.iter().fold(nothing, |behind, range| {
        let part = part(&scene, range.clone());
        let front = render_bounded(&part.as_oracle(), &camera(), &OracleState::default());
        let over = |(pixel, behind): (usize, Vec<[f64; 4]>)| {
            let fronts = front.outcomes(pixel);
            fronts.flat_map(|front| behind.iter().map(|behind| composite(*front, *behind))).collect()
        };
        behind.into_iter().enumerate().map(over).collect()
    });
    let record = |commands: &Commands| {
        for range in &parts {
            commands.draw(range.start as u32..range.start as u32 + range.len() as u32);
        }
    };
    let drawn: Vec<[f32; 4]> = bench.draw_to(&bench.target(), &Pass::clear(background), record);
    for (rgba, outcomes) in drawn.iter().zip(&expected) {
        let nearest = outcomes.iter().map(|outcome| distance(*rgba, *outcome));
        let nearest = nearest.fold(f64::INFINITY, f64::min);
        assert!(nearest <= 5e-6, "{rgba:?} is {nearest:e} from {outcomes:?}");
    }

    // The same draws by one indirect command.
    let numbers: Vec<[u32; 4]> = parts.iter().map(|range| [range.len() as u32, 1, range.start as u32, 0]).collect();
    let numbers = Buffer::of(&bench.gpu, &numbers);
    let indirect = bench.draw_to(&bench.target(), &Pass::clear(background), |commands| {
        commands.draw_indirect(&numbers, parts.len() as u32);
    });
    assert_same(&drawn, &indirect);

    // The same draws in separate passes, each of which loads the result of the one before.
    let target = bench.target();
    bench.draw_to::<[f32; 4]>(&target, &Pass::clear(background), |_| ());
    let mut passes = Vec::new();
    for range in &parts {
        passes = bench.draw_to(&target, &Pass::load(), |commands| {
            commands.draw(range.start as u32..range.start as u32 + range.len() as u32);
        });
    }
    assert_same(&drawn, &passes);
}

#[gaurast_runner::test]
fn a_render_pass_object_is_dynamic_rendering() {
    let scene = scene();
    let dynamic = Bench::new(&scene);
    let background = [0.5, 0.25, 0.125, 1.0];
    let pass = Pass::clear(background);
    let expected: Vec<[f32; 4]> = dynamic.draw_to(&dynamic.target(), &pass, |commands| {
        commands.draw(0..dynamic.scene.count);
    });

    let Bench { gpu, scene: on_device, camera, .. } = dynamic;
    let target = Target::floats(&gpu, SIZE);
    let object = PassObject::new(&target);
    let options = GaussianOptions { render_pass: Some(object.render_pass), ..GaussianOptions::new(scene.degree) };
    let pipeline = GaussianPipeline::new(&gpu, &options);
    gpu.run(|commands| {
        commands.pass(&object, &pass, || {
            on_device.bind(commands, &pipeline, &camera);
            commands.draw(0..on_device.count);
        });
    });
    assert_same(&expected, &target.read());
    assert_eq!(gpu.messages(), []);
}

#[gaurast_runner::test]
fn formats_differ_by_their_quantisation_alone() {
    let scene = scene();
    let exact = Bench::new(&scene).whole();
    let draw = |format| {
        let options = GaussianOptions { formats: Formats::of(format), ..GaussianOptions::new(scene.degree) };
        let bench = Bench::with(&scene, &Settings::default(), &options);
        let target = Target::new(&bench.gpu, &TargetOptions { size: SIZE, ..TargetOptions::of(format) });
        let pass = Pass::clear([0.0; 4]);
        bench.draw_to::<u8>(&target, &pass, |commands| {
            commands.draw(0..bench.scene.count);
        });
        (bench, target)
    };
    let quantised = |value: f32| (255.0 * value.clamp(0.0, 1.0)).round() as u8;
    let bytes = exact.iter().map(|rgba| rgba.map(quantised));

    let (_bench, target) = draw(vk::Format::R8G8B8A8_UNORM);
    let rgba: Vec<[u8; 4]> = target.read();
    // At half a step, rounding may go either way.
    for (expected, texel) in bytes.clone().zip(&rgba) {
        let steps = expected.iter().zip(texel).map(|(a, b)| a.abs_diff(*b));
        assert!(steps.max() <= Some(1), "{texel:?} for {expected:?}");
    }
    let differing = bytes.zip(&rgba).filter(|(a, b)| a != *b).count();
    assert!(differing <= 2, "{differing} texels are rounded another way");

    let (_bench, target) = draw(vk::Format::B8G8R8A8_UNORM);
    let bgra: Vec<[u8; 4]> = target.read();
    let swapped: Vec<[u8; 4]> = bgra.iter().map(|&[b, g, r, a]| [r, g, b, a]).collect();
    assert!(rgba == swapped);

    let (_bench, target) = draw(vk::Format::R16G16B16A16_SFLOAT);
    let halves: Vec<[u16; 4]> = target.read();
    for (expected, texel) in exact.iter().zip(&halves) {
        let nearest = expected.map(|value| f16::from_f32(value).to_bits());
        assert_eq!(nearest, *texel, "{expected:?}");
    }
}
