//! Whole draws with random tests against a twin that takes each sample for itself.

use super::*;
use crate::format::Aspect;
use crate::format::depth::{DepthEncoding, ordered, unordered};
use crate::image::{Image, ImageDesc, ImageKind, ImageView};
use crate::packet::*;
use crate::pass::{Pass, PassDraw};
use crate::raster::depth_stencil::apply;
use crate::raster::tests::blender::Blender;
use crate::state::gaussian::{GaussianOrder, GaussianPrecision, GaussianState};
use crate::state::{
    BlendEquation, BlendEquations, BlendFactor, BlendOp, BlendState, CompareOp, DepthStencil, DepthTest, Rect,
    StencilFace, StencilOp,
};
use crate::stats::recorder::Recorder;
use rand::seq::IndexedRandom;
use timing::work::Saturation;

const DEPTHS: [Format; 5] =
    [Format::D16Unorm, Format::X8D24UnormPack32, Format::D32Sfloat, Format::D24UnormS8Uint, Format::D32SfloatS8Uint];
const COLORS: [Format; 4] =
    [Format::R32G32B32A32Sfloat, Format::R8G8B8A8Unorm, Format::B8G8R8A8Srgb, Format::R16G16B16A16Sfloat];
const COMPARES: [CompareOp; 8] = [
    CompareOp::Never,
    CompareOp::Less,
    CompareOp::Equal,
    CompareOp::LessOrEqual,
    CompareOp::Greater,
    CompareOp::NotEqual,
    CompareOp::GreaterOrEqual,
    CompareOp::Always,
];
const STENCIL_OPS: [StencilOp; 8] = [
    StencilOp::Keep,
    StencilOp::Zero,
    StencilOp::Replace,
    StencilOp::IncrementAndClamp,
    StencilOp::DecrementAndClamp,
    StencilOp::Invert,
    StencilOp::IncrementAndWrap,
    StencilOp::DecrementAndWrap,
];

/// Depth coefficients that take 1 to 6 to 0 to 1, and to 1 to 0.
const FORWARD: [f32; 2] = [1.2, -1.2];
const REVERSE: [f32; 2] = [-0.2, 1.2];

fn one_of<T: Copy>(rng: &mut ChaCha8Rng, of: &[T]) -> T {
    *of.choose(rng).unwrap()
}

/// A draw, and the attachments before it: by sample of each pixel.
struct Scene {
    seed: u64,
    state: GaussianState,
    samples: u32,
    bounds: Rect,
    color: Format,
    depth: Format,
    coefficients: [f32; 2],
    before: Picture,
}

/// The contents of attachments, by sample of each pixel.
#[derive(Clone, Debug, PartialEq)]
struct Picture {
    color: Vec<[f32; 4]>,
    depth: Vec<u32>,
    stencil: Vec<u8>,
    passed: u64,
}

fn random_state(rng: &mut ChaCha8Rng) -> GaussianState {
    let face = |rng: &mut ChaCha8Rng| StencilFace {
        fail: one_of(rng, &STENCIL_OPS),
        pass: one_of(rng, &STENCIL_OPS),
        depth_fail: one_of(rng, &STENCIL_OPS),
        compare: one_of(rng, &COMPARES),
        compare_mask: one_of(rng, &[1, 3, 0xFF]),
        write_mask: one_of(rng, &[0, 0x0F, 0xFF]),
        reference: rng.random_range(0..4),
    };
    let over = BlendEquation { source: BlendFactor::One, destination: BlendFactor::OneMinusSrcAlpha, op: BlendOp::Add };
    let precision = one_of(rng, &[GaussianPrecision::Float32, GaussianPrecision::Float32, GaussianPrecision::Float16]);
    GaussianState {
        precision,
        order: one_of(
            rng,
            &[
                GaussianOrder::ViewDepth,
                GaussianOrder::ViewDepth,
                GaussianOrder::RadialDistance,
                GaussianOrder::Primitive,
                GaussianOrder::PerPixel,
            ],
        ),
        transmittance_floor: one_of(rng, &[0.0, 1e-4, 0.3]),
        sample_mask: one_of(rng, &[u32::MAX, u32::MAX, 0b1011]),
        depth_stencil: DepthStencil {
            depth: rng.random_bool(0.9).then(|| DepthTest { compare: one_of(rng, &COMPARES), write: rng.random() }),
            bounds: rng.random_bool(0.2).then_some((0.25, 0.9)),
            stencil: rng.random_bool(0.5).then(|| [face(rng), face(rng)]),
        },
        blend: vec![BlendState {
            equations: rng.random_bool(0.7).then_some(BlendEquations::both(over)),
            write_mask: one_of(rng, &[0xF, 0xF, 0b0101]),
        }],
        ..defaults()
    }
}

fn random_scene(seed: u64) -> Scene {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let samples = one_of(&mut rng, &[1, 4]);
    let (color, depth) = (one_of(&mut rng, &COLORS), one_of(&mut rng, &DEPTHS));
    let coefficients = one_of(&mut rng, &[FORWARD, REVERSE]);
    let state = random_state(&mut rng);
    let bounds = one_of(&mut rng, &[WHOLE, Rect { x: 5, y: 3, width: 70, height: 51 }]);
    // Depths that Gaussians have, so that equal ones occur.
    let device = Device::new(&Config::default()).unwrap();
    let like = Some((depth.plane(Aspect::Depth).unwrap(), coefficients));
    let tested = GaussianState {
        depth_stencil: DepthStencil {
            depth: Some(DepthTest { compare: CompareOp::Always, write: true }),
            ..DepthStencil::default()
        },
        ..state.clone()
    };
    let draw = draw_with_depth(seed, 300, tested, &device, WHOLE, like);
    let depths: Vec<u32> = draw.sorted.splats.iter().flatten().map(|g| g.look.depth).collect();
    let count = (96 * 64 * samples) as usize;
    let mut before = Picture {
        color: Vec::with_capacity(count),
        depth: Vec::with_capacity(count),
        stencil: Vec::with_capacity(count),
        passed: 0,
    };
    let has_stencil = depth.plane(Aspect::Stencil).is_some();
    for at in 0..count {
        let (pixel, sample) = (at as u32 / samples, at as u32 % samples);
        // Large areas of one depth, some of which differ by sample.
        let [x, y] = [pixel % 96, pixel / 96];
        let area = x / 24 + y / 20 * 4;
        let part = if area % 3 == 0 && x + y < 90 { sample } else { 0 };
        before.depth.push(depths[(area * 31 + part * 7) as usize % depths.len()]);
        let stencil = ((x / 7 + y / 5 + part) % 4) as u8;
        before.stencil.push(if has_stencil { stencil } else { 0 });
        let texel = [0.125, 0.5, 0.25, 1.0].map(|c| c + 0.001 * (x % 9) as f32);
        let bytes = color.encode(texel);
        before.color.push(color.decode(&bytes));
    }
    Scene { seed, state, samples, bounds, color, depth, coefficients, before }
}

impl Scene {
    fn draw(&self, device: &Device) -> BinnedDraw {
        let depth = Some((self.depth.plane(Aspect::Depth).unwrap(), self.coefficients));
        draw_with_depth(self.seed, 300, self.state.clone(), device, self.bounds, depth)
    }

    /// Each sample for itself.
    fn naive(&self, draw: &BinnedDraw) -> Picture {
        let mut picture = self.before.clone();
        let state = &self.state;
        let blender = Blender::new(&state.blend[0], state.blend_constants, self.color);
        let tests = &state.depth_stencil;
        let has_stencil = self.depth.plane(Aspect::Stencil).is_some();
        for at in 0..picture.depth.len() {
            let (pixel, sample) = (at as u32 / self.samples, at as u32 % self.samples);
            let [x, y] = [pixel % 96, pixel / 96];
            let here = Rect { x: x as i32, y: y as i32, width: 1, height: 1 };
            if self.bounds.intersect(here).is_empty() || state.sample_mask >> sample & 1 == 0 {
                continue;
            }
            let stored = picture.depth[at];
            let depth = match self.depth.plane(Aspect::Depth).unwrap() {
                Format::D16Unorm => f64::from(stored) / 65535.0,
                Format::X8D24UnormPack32 => f64::from(stored) / 16_777_215.0,
                _ => f32::from_bits(unordered(stored)).into(),
            };
            if tests.bounds.is_some_and(|(least, greatest)| depth < least.into() || depth > greatest.into()) {
                continue;
            }
            let face = tests.stencil.map(|[front, _]| front).filter(|_| has_stencil);
            let stencil_passes = face.is_none_or(|face| {
                let masked = picture.stencil[at] & face.compare_mask;
                face.compare.holds(face.reference & face.compare_mask, masked)
            });
            let tile = [x / 16, y / 16];
            let inside = [x % 16, y % 16].map(|at| at as usize);
            let found = naive_sample(draw, tile, inside, |depth| {
                stencil_passes && tests.depth.is_none_or(|test| test.compare.holds(depth, stored))
            });
            if let Some(face) = face.filter(|_| found.reached) {
                let op = match (stencil_passes, found.fragment.is_some()) {
                    (false, _) => face.fail,
                    (true, false) => face.depth_fail,
                    (true, true) => face.pass,
                };
                let old = picture.stencil[at];
                let new = apply(op, old, face.reference);
                picture.stencil[at] = old & !face.write_mask | new & face.write_mask;
            }
            let Some(fragment) = found.fragment else {
                continue;
            };
            picture.passed += 1;
            if tests.depth.is_some_and(|test| test.write) {
                picture.depth[at] = found.median;
            }
            let blended = blender.blend(fragment, picture.color[at]);
            picture.color[at] = self.color.decode(&self.color.encode(blended));
        }
        picture
    }

    fn image(&self, format: Format) -> ImageView {
        let desc = ImageDesc {
            kind: ImageKind::D2,
            format,
            extent: [96, 64, 1],
            mip_levels: 1,
            array_layers: 1,
            samples: self.samples,
        };
        let memory = Allocation::new_zeroed(desc.memory_size().unwrap()).unwrap();
        ImageView {
            image: Arc::new(Image::new(desc, memory, 0).unwrap()),
            format,
            base_mip_level: 0,
            level_count: 1,
            base_layer: 0,
            layer_count: 1,
        }
    }

    /// Calls `with` for each sample's texel of an aspect: its index, where it is, and its size.
    fn each(
        &self,
        view: &ImageView,
        aspect: Aspect,
        mut with: impl FnMut(usize, &crate::image::SubresourceLayout, [u32; 3], usize),
    ) {
        let Some(layout) = view.image.subresource(aspect, 0, 0) else {
            return;
        };
        for at in 0..self.before.depth.len() {
            let (pixel, sample) = (at as u32 / self.samples, at as u32 % self.samples);
            let layout = layout.sample(sample);
            let size = layout.format.texel_size();
            with(at, &layout, [pixel % 96, pixel / 96, 0], size);
        }
    }

    /// Draws it on a device.
    fn render(&self, device: &Device) -> Picture {
        let (color, depth) = (self.image(self.color), self.image(self.depth));
        let is_float = self.depth.plane(Aspect::Depth) == Some(Format::D32Sfloat);
        let before = &self.before;
        let write = |view: &ImageView, aspect, texel: &dyn Fn(usize) -> Vec<u8>| {
            self.each(view, aspect, |at, layout, place, size| {
                let bytes = &texel(at)[..size];
                view.image.write_row(layout, place, bytes).unwrap();
            });
        };
        write(&color, Aspect::Color, &|at| self.color.encode(before.color[at]).to_vec());
        write(&depth, Aspect::Depth, &|at| {
            let code = before.depth[at];
            let word = if is_float { unordered(code) } else { code };
            word.to_le_bytes().to_vec()
        });
        write(&depth, Aspect::Stencil, &|at| vec![before.stencil[at]]);
        let attachment = |view: &ImageView| Attachment {
            view: view.clone(),
            load: LoadOp::Load,
            store: StoreOp::Store,
            resolve: None,
            multisampled: None,
        };
        let has_stencil = self.depth.plane(Aspect::Stencil).is_some();
        let mut pass = Pass::begin(&Rendering {
            area: WHOLE,
            layer_count: 1,
            view_mask: 0,
            color: vec![Some(attachment(&color))],
            depth: Some(attachment(&depth)),
            stencil: has_stencil.then(|| attachment(&depth)),
        })
        .unwrap();
        let mut counters = Counters::default();
        let draw = PassDraw::Gaussians(Box::new(self.draw(device)));
        pass.push(draw, device.runtime(), &mut counters).unwrap();
        pass.end(device.runtime(), &mut counters).unwrap();
        let read = |view: &ImageView, aspect| {
            let mut texels = Vec::new();
            self.each(view, aspect, |_, layout, place, size| {
                let mut bytes = vec![0; size];
                view.image.read_row(layout, place, &mut bytes).unwrap();
                bytes.resize(16, 0);
                texels.push(bytes);
            });
            texels
        };
        let word = |bytes: Vec<u8>| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        let colors = read(&color, Aspect::Color).into_iter();
        let depths = read(&depth, Aspect::Depth).into_iter().map(word);
        let stencils = read(&depth, Aspect::Stencil).into_iter();
        Picture {
            color: colors.map(|bytes| self.color.decode(&bytes)).collect(),
            depth: depths.map(|word| if is_float { ordered(word) } else { word }).collect(),
            stencil: if has_stencil { stencils.map(|bytes| bytes[0]).collect() } else { before.stencil.clone() },
            passed: counters.get(Counter::SamplesPassed),
        }
    }
}

#[gaurast_runner::test(each = simd_levels())]
fn random_tests_agree_with_the_twin(case: &Case) {
    let device = device_of(case);
    let mut changed = 0;
    for seed in 0..60 {
        let scene = random_scene(seed);
        let expected = scene.naive(&scene.draw(&device));
        let found = scene.render(&device);
        for at in 0..expected.depth.len() {
            let of = |p: &Picture| (p.color[at], p.depth[at], p.stencil[at]);
            assert_eq!(
                of(&found),
                of(&expected),
                "seed {seed}, {:?}, {:?}, {} samples, sample {at} of {:?}, {:?}",
                scene.color,
                scene.depth,
                scene.samples,
                of(&scene.before),
                scene.state,
            );
        }
        assert_eq!(found.passed, expected.passed, "seed {seed}");
        changed += u32::from(expected.passed > 0);
    }
    assert!(changed > 20, "hardly anything was drawn");
}

/// The counters of a draw in a tile whose stored depths are the same everywhere, and its work.
fn hidden(coefficients: [f32; 2], compare: CompareOp, stored: f32) -> Counters {
    hidden_work(coefficients, compare, [stored; 256], None, |_| {})
}

/// As [`hidden`], of any stored depths, for whoever records, of a draw that is changed before.
fn hidden_work(
    coefficients: [f32; 2],
    compare: CompareOp,
    stored: [f32; 256],
    recorder: Option<Arc<Recorder>>,
    change: impl Fn(&mut BinnedDraw),
) -> Counters {
    let device = Device::new(&Config { recorder, ..Config::default() }).unwrap();
    if let Some(recorder) = &device.runtime().config().recorder {
        recorder.begin_frame(0, WHOLE);
    }
    let state = GaussianState {
        // No pixel finishes, so that what is hidden is all that differs.
        alpha_ceiling: 0.02,
        depth_stencil: DepthStencil { depth: Some(DepthTest { compare, write: false }), ..DepthStencil::default() },
        ..defaults()
    };
    let mut draw = draw_with_depth(3, 300, state, &device, WHOLE, Some((Format::D32Sfloat, coefficients)));
    change(&mut draw);
    if let Some((recorder, record)) = device.runtime().recorder().zip(draw.record.as_ref()) {
        recorder.add_draw(0, record);
    }
    let mut tile = Box::new(GaussianTile::default());
    let mut counters = Counters::default();
    let lanes = [u32::from(u16::MAX); BLOCKS];
    let codes = stored.map(|depth| DepthEncoding::Float.encode_one(depth));
    tile.ranges.set(compare, &codes, &lanes);
    tile.run::<TestDepth>(&draw, device.level(), [2, 2], 0, &lanes, &mut counters);
    let pairs = counters.get(Counter::TilePairsEvaluated);
    assert!(pairs <= draw.sorted.tiles.list(2, 2).len() as u64);
    counters
}

#[gaurast_runner::test]
fn what_is_behind_a_whole_tile_is_not_even_fetched() {
    let (forward, reverse) = (hidden(FORWARD, CompareOp::Less, 0.3), hidden(REVERSE, CompareOp::Greater, 0.7));
    let everything = hidden(FORWARD, CompareOp::Always, 0.3);
    for counters in [forward, reverse] {
        assert!(counters.get(Counter::GaussianTilesHidden) > 0);
        let read =
            |counters: &Counters| (counters.get(Counter::TilePairsEvaluated), counters.get(Counter::BlockEvaluations));
        let (pairs, blocks) = read(&counters);
        let (all_pairs, all_blocks) = read(&everything);
        assert!(pairs <= all_pairs && blocks < all_blocks);
        assert!(pairs > 0 && blocks > 0, "what is in front is drawn");
    }
    let nothing = hidden(FORWARD, CompareOp::Less, 0.0);
    assert_eq!(nothing.get(Counter::BlockEvaluations), 0);
    assert_eq!(everything.get(Counter::GaussianTilesHidden), 0);
}

#[gaurast_runner::test]
fn gaussians_in_binary64_behind_a_whole_tile_are_not_fetched_either() {
    // The nearer ones fail, so that no list's end is hidden at once.
    let hidden = |change: fn(&mut BinnedDraw)| {
        let counters = hidden_work(FORWARD, CompareOp::Greater, [0.3; 256], None, change);
        counters.get(Counter::GaussianTilesHidden)
    };
    let in_f64 = hidden(|draw| {
        let sorted = Arc::get_mut(&mut draw.sorted).unwrap();
        for splat in sorted.splats.iter_mut().flatten() {
            splat.needs_f64 = true;
        }
    });
    assert!(in_f64 > 0);
    assert_eq!(in_f64, hidden(|_| {}));
}

#[gaurast_runner::test]
fn the_trace_tells_what_depths_hide() {
    let tile_of = |coefficients, compare, stored: [f32; 256]| {
        let recorder = Arc::new(Recorder::default());
        let counters = hidden_work(coefficients, compare, stored, Some(Arc::clone(&recorder)), |_| {});
        assert_eq!(counters, hidden_work(coefficients, compare, stored, None, |_| {}), "recording changes no counter");
        let tile = recorder.trace().frames[0].draws[0].tiles[0].clone();
        (tile, counters)
    };
    // Half of the tile's pixels are nearer.
    let slope: [f32; 256] = std::array::from_fn(|at| if at < 128 { 0.3 } else { 0.35 });
    for (coefficients, compare, stored, ends) in [
        (FORWARD, CompareOp::Less, [0.3; 256], true),
        (FORWARD, CompareOp::Less, slope, true),
        (FORWARD, CompareOp::Less, [0.0; 256], true),
        (REVERSE, CompareOp::Greater, [0.7; 256], true),
        (FORWARD, CompareOp::Greater, [0.3; 256], false),
    ] {
        let (tile, counters) = tile_of(coefficients, compare, stored);
        let (open, everything) = tile_of(coefficients, CompareOp::Always, stored);
        let reached = |tile: &TileWork| tile.runs.iter().map(|run| run.reached).sum::<u32>();
        assert_eq!(u64::from(tile.hidden()), counters.get(Counter::GaussianTilesHidden));
        assert_eq!(u64::from(reached(&tile)), counters.get(Counter::BlockEvaluations));
        assert_eq!(reached(&tile) + tile.hidden_blocks(), reached(&open));
        assert_eq!(u64::from(reached(&open)), everything.get(Counter::BlockEvaluations));
        assert_eq!((tile.needed(), open.needed()), (tile.listed, tile.listed));
        assert_eq!((open.hidden(), open.hidden_blocks()), (0, 0));
        assert!(tile.hidden() > 0 && tile.hidden_blocks() > 0);
        assert_eq!(tile.hidden_rest > 0, ends, "{compare:?}");
        assert!(tile.hidden_rest <= tile.runs.last().unwrap().hidden);
        for saturation in Saturation::ALL {
            let evaluations = |hierarchical| tile.evaluations(saturation, hierarchical);
            assert!(evaluations(true) < evaluations(false), "{saturation:?}");
            let open = open.evaluations(saturation, false);
            assert_eq!(evaluations(false), open, "hardware that cannot hide");
        }
    }
}
