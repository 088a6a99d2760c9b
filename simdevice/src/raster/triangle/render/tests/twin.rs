//! Tests of random states against the naive reference.

use super::*;
use crate::packet::Rendering;
use crate::raster::depth_stencil::apply;
use crate::raster::tests::blender::Blender;
use crate::raster::triangle::coverage::tests::covers;

const COLORS: [Format; 12] = [
    Format::R8G8B8A8Unorm,
    Format::B8G8R8A8Unorm,
    Format::R8G8B8A8Srgb,
    Format::R16G16B16A16Sfloat,
    Format::R32G32B32A32Sfloat,
    Format::R5G6B5UnormPack16,
    Format::A2B10G10R10UnormPack32,
    Format::R8Unorm,
    Format::R8G8B8A8Snorm,
    Format::R32Sfloat,
    Format::R32G32B32A32Uint,
    Format::R8G8B8A8Uint,
];
const DEPTHS: [Format; 5] =
    [Format::D16Unorm, Format::X8D24UnormPack32, Format::D32Sfloat, Format::D24UnormS8Uint, Format::D32SfloatS8Uint];
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
const FACTORS: [BlendFactor; 19] = [
    BlendFactor::Zero,
    BlendFactor::One,
    BlendFactor::SrcColor,
    BlendFactor::OneMinusSrcColor,
    BlendFactor::DstColor,
    BlendFactor::OneMinusDstColor,
    BlendFactor::SrcAlpha,
    BlendFactor::OneMinusSrcAlpha,
    BlendFactor::DstAlpha,
    BlendFactor::OneMinusDstAlpha,
    BlendFactor::ConstantColor,
    BlendFactor::OneMinusConstantColor,
    BlendFactor::ConstantAlpha,
    BlendFactor::OneMinusConstantAlpha,
    BlendFactor::SrcAlphaSaturate,
    BlendFactor::Src1Color,
    BlendFactor::OneMinusSrc1Color,
    BlendFactor::Src1Alpha,
    BlendFactor::OneMinusSrc1Alpha,
];
const LOGIC_OPS: [LogicOp; 16] = [
    LogicOp::Clear,
    LogicOp::And,
    LogicOp::AndReverse,
    LogicOp::Copy,
    LogicOp::AndInverted,
    LogicOp::NoOp,
    LogicOp::Xor,
    LogicOp::Or,
    LogicOp::Nor,
    LogicOp::Equivalent,
    LogicOp::Invert,
    LogicOp::OrReverse,
    LogicOp::CopyInverted,
    LogicOp::OrInverted,
    LogicOp::Nand,
    LogicOp::Set,
];

/// A pass of a few draws of flat colours.
struct Scene {
    samples: u32,
    color: Format,
    depth: Option<Format>,
    draws: Vec<SceneDraw>,
}

/// A draw of a scene. Each primitive has ten varyings at its provoking vertex: two colours, a value that kills it if
/// above 0.5, and a depth.
struct SceneDraw {
    state: DrawState,
    primitives: Vec<Primitive>,
    values: Vec<[u32; 10]>,
    discards: bool,
    early_tests: bool,
    writes_depth: bool,
    writes_stencil_reference: bool,
}

impl SceneDraw {
    /// The stencil reference that the program writes for a primitive: the last bits of the value that kills it.
    fn stencil_reference(&self, values: &[u32; 10]) -> Option<u8> {
        (self.writes_stencil_reference && !self.early_tests).then_some(values[8] as u8)
    }
}

const CLEAR: [u32; 4] = [0x3F40_0000, 0x3E80_0000, 0x3F00_0000, 0x3F19_999A];
const CLEAR_DEPTH: f32 = 0.6;
const CLEAR_STENCIL: u32 = 0x35;

fn one_of<T: Copy>(rng: &mut ChaCha8Rng, of: &[T]) -> T {
    *of.choose(rng).unwrap()
}

fn equation(rng: &mut ChaCha8Rng) -> BlendEquation {
    let ops = [BlendOp::Add, BlendOp::Subtract, BlendOp::ReverseSubtract, BlendOp::Min, BlendOp::Max];
    BlendEquation { source: one_of(rng, &FACTORS), destination: one_of(rng, &FACTORS), op: one_of(rng, &ops) }
}

fn face(rng: &mut ChaCha8Rng) -> StencilFace {
    StencilFace {
        fail: one_of(rng, &STENCIL_OPS),
        pass: one_of(rng, &STENCIL_OPS),
        depth_fail: one_of(rng, &STENCIL_OPS),
        compare: one_of(rng, &COMPARES[1..]),
        compare_mask: rng.random(),
        write_mask: rng.random(),
        reference: rng.random(),
    }
}

fn scene(rng: &mut ChaCha8Rng) -> Scene {
    let samples = one_of(rng, &[1, 4]);
    let color = one_of(rng, &COLORS);
    let depth = rng.random_bool(0.8).then(|| one_of(rng, &DEPTHS));
    let draws = (0..3).map(|_| {
        let mut state = state(samples);
        if rng.random_bool(0.7) {
            state.depth_stencil.depth = Some(DepthTest { compare: one_of(rng, &COMPARES[1..]), write: rng.random() });
        }
        if rng.random_bool(0.2) {
            state.depth_stencil.bounds = Some((0.25, 0.7));
        }
        if rng.random_bool(0.5) {
            state.depth_stencil.stencil = Some([face(rng), face(rng)]);
        }
        if rng.random_bool(0.2) {
            state.sample_mask = rng.random();
        }
        if rng.random_bool(0.3) {
            state.logic_op = Some(one_of(rng, &LOGIC_OPS));
        }
        state.alpha_to_one = rng.random_bool(0.1);
        state.alpha_to_coverage = !color.is_integer() && rng.random_bool(0.15);
        state.scissors = vec![Rect {
            x: rng.random_range(-3..20),
            y: rng.random_range(-3..20),
            width: rng.random_range(40..100),
            height: rng.random_range(40..100),
        }];
        state.blend = vec![BlendState {
            equations: rng.random_bool(0.6).then(|| BlendEquations { color: equation(rng), alpha: equation(rng) }),
            write_mask: one_of(rng, &[0xF, 0xF, 0xF, 0b0101, 0b1110, 0]),
        }];
        let count = rng.random_range(1..40);
        let primitives: Vec<_> = (0..count).map(|index| triangle(rng, index)).collect();
        let value = |rng: &mut ChaCha8Rng| {
            if color.is_integer() {
                one_of(rng, &[0, 1, 200, 0xDEAD_BEEF, u32::MAX])
            } else {
                one_of(rng, &[-0.5f32, 0.0, 0.1, 0.333, 0.5, 0.8, 1.0, 1.7]).to_bits()
            }
        };
        let values = (0..count)
            .map(|_| {
                let mut values = [0; 10].map(|_| value(rng));
                values[8] = rng.random::<f32>().to_bits();
                values[9] = (rng.random_range(-1..9) as f32 / 7.0).to_bits();
                values
            })
            .collect();
        SceneDraw {
            state,
            primitives,
            values,
            discards: rng.random_bool(0.3),
            early_tests: rng.random_bool(0.3),
            writes_depth: rng.random_bool(0.25),
            writes_stencil_reference: rng.random_bool(0.2),
        }
    });
    let draws = draws.collect();
    Scene { samples, color, depth, draws }
}

/// The content of the images by pixel and sample (bytes of colours, encoded depths, stencils), and the number of
/// samples that passed.
#[derive(Debug, PartialEq)]
struct Picture {
    color: Vec<Vec<u8>>,
    depth: Vec<u32>,
    stencil: Vec<u8>,
    passed: u64,
}

fn color_clear(scene: &Scene) -> ClearValue {
    if scene.color.is_integer() { ClearValue::Uint(CLEAR) } else { ClearValue::Float(CLEAR.map(f32::from_bits)) }
}

/// The encoding of a depth from 0 to 1 in a depth format.
fn depth_code(format: Format, depth: f32) -> u32 {
    match format {
        Format::D16Unorm => (f64::from(depth) * 65_535.0).round_ties_even() as u32,
        Format::X8D24UnormPack32 | Format::D24UnormS8Uint => (f64::from(depth) * 16_777_215.0).round_ties_even() as u32,
        _ => depth.to_bits(),
    }
}

/// Renders the scene sample by sample.
fn naive(scene: &Scene) -> Picture {
    let positions: &[[i32; 2]] = if scene.samples == 1 { &CENTER } else { &SAMPLES_4 };
    let count = (WIDTH * HEIGHT * scene.samples) as usize;
    let size = scene.color.texel_size();
    let clear = scene.color.encode_clear(Aspect::Color, color_clear(scene));
    let depth = scene.depth.map_or(0, |format| depth_code(format, CLEAR_DEPTH));
    let has_stencil = scene.depth.is_some_and(|format| format.plane(Aspect::Stencil).is_some());
    let mut picture = Picture {
        color: vec![clear[..size].to_vec(); count],
        depth: vec![depth; count],
        stencil: vec![if has_stencil { CLEAR_STENCIL as u8 } else { 0 }; count],
        passed: 0,
    };
    for draw in &scene.draws {
        let blender = Blender::new(&draw.state.blend[0], draw.state.blend_constants, scene.color);
        for (primitive, values) in draw.primitives.iter().zip(&draw.values) {
            let left = primitive.corners.map(|c| c[0]).into_iter().min().unwrap() >> 8;
            let right = primitive.corners.map(|c| c[0]).into_iter().max().unwrap() >> 8;
            for at in 0..count {
                let (pixel, sample) = (at as u32 / scene.samples, at as u32 % scene.samples);
                let (x, y) = ((pixel % WIDTH) as i32, (pixel / WIDTH) as i32);
                if x < left || x > right {
                    continue;
                }
                let place = [[x, y], positions[sample as usize]];
                let place = std::array::from_fn(|axis| i64::from(place[0][axis] * 256 + place[1][axis]));
                let here = Rect { x, y, width: 1, height: 1 };
                if draw.state.sample_mask >> sample & 1 == 0
                    || draw.state.scissors[0].intersect(here).is_empty()
                    || !covers(primitive, place)
                {
                    continue;
                }
                fragment(scene, draw, &blender, primitive, values, at, sample, has_stencil, &mut picture);
            }
        }
    }
    picture
}

/// Processes one sample of a primitive.
#[allow(clippy::too_many_arguments, reason = "a test's twin is spelled out")]
fn fragment(
    scene: &Scene,
    draw: &SceneDraw,
    blender: &Blender,
    primitive: &Primitive,
    values: &[u32; 10],
    at: usize,
    sample: u32,
    has_stencil: bool,
    picture: &mut Picture,
) {
    let alpha = f32::from_bits(values[3]);
    let is_killed = draw.discards && f32::from_bits(values[8]) > 0.5;
    let least = if scene.samples == 1 { 0.5 } else { f32::from_bits((sample as f32 / 4.0).to_bits() + 1) };
    let is_covered = !draw.state.alpha_to_coverage || alpha >= least;
    let kept = !is_killed && is_covered;
    if !kept && !draw.early_tests {
        return;
    }
    let tests = &draw.state.depth_stencil;
    if let (Some(format), Some((least, greatest))) = (scene.depth, tests.bounds) {
        let stored = picture.depth[at];
        if stored < depth_code(format, least) || stored > depth_code(format, greatest) {
            return;
        }
    }
    let face = tests.stencil.filter(|_| has_stencil).map(|faces| faces[usize::from(!primitive.front)]);
    let written = draw.stencil_reference(values);
    let face = face.map(|face| StencilFace { reference: written.unwrap_or(face.reference), ..face });
    let stencil = picture.stencil[at];
    let stencil_passes =
        face.is_none_or(|face| face.compare.holds(face.reference & face.compare_mask, stencil & face.compare_mask));
    let depth = if draw.writes_depth && !draw.early_tests {
        f32::from_bits(values[9]).clamp(0.0, 1.0)
    } else {
        primitive.depth[0]
    };
    let code = scene.depth.map(|format| depth_code(format, depth));
    let depth_passes = match (code, tests.depth) {
        (Some(code), Some(test)) => test.compare.holds(code, picture.depth[at]),
        _ => true,
    };
    if let Some(face) = face {
        let op = match (stencil_passes, depth_passes) {
            (false, _) => face.fail,
            (true, false) => face.depth_fail,
            (true, true) => face.pass,
        };
        let value = apply(op, stencil, face.reference);
        picture.stencil[at] = stencil & !face.write_mask | value & face.write_mask;
    }
    if !stencil_passes || !depth_passes {
        return;
    }
    if let (Some(code), Some(DepthTest { write: true, .. })) = (code, tests.depth) {
        picture.depth[at] = code;
    }
    picture.passed += 1;
    if kept {
        blend(scene, draw, blender, values, &mut picture.color[at]);
    }
}

/// Blends the colour of one sample.
fn blend(scene: &Scene, draw: &SceneDraw, blender: &Blender, values: &[u32; 10], stored: &mut [u8]) {
    let mut source: [f32; 4] = std::array::from_fn(|c| f32::from_bits(values[c]));
    let mut second: [f32; 4] = std::array::from_fn(|c| f32::from_bits(values[4 + c]));
    if draw.state.alpha_to_one {
        (source[3], second[3]) = (1.0, 1.0);
    }
    let format = scene.color;
    let logic = draw.state.logic_op.filter(|_| {
        !matches!(
            format,
            Format::R8G8B8A8Srgb | Format::R16G16B16A16Sfloat | Format::R32G32B32A32Sfloat | Format::R32Sfloat
        )
    });
    let destination = format.decode(stored);
    let value = match (logic, draw.state.logic_op) {
        (Some(op), _) => {
            let new = format.encode(source);
            let bytes: Vec<u8> = stored.iter().zip(new).map(|(&d, s)| logic_byte(op, s, d)).collect();
            // -1 has two encodings, and a logic operation may give either.
            if format == Format::R8G8B8A8Snorm {
                for (byte, new) in bytes.into_iter().enumerate() {
                    if draw.state.blend[0].write_mask >> byte & 1 == 1 {
                        stored[byte] = new;
                    }
                }
                return;
            }
            format.decode(&bytes)
        }
        // Other formats take the unchanged source.
        (None, Some(_)) => source,
        (None, None) => blender.blend_dual(source, second, destination),
    };
    let mask = draw.state.blend[0].write_mask;
    let masked: [f32; 4] =
        std::array::from_fn(
            |component| {
                if mask >> component & 1 == 1 { value[component] } else { destination[component] }
            },
        );
    for (byte, new) in format.encode(masked)[..stored.len()].iter().enumerate() {
        // -1 has two encodings, and a component that is not written keeps its own.
        if format != Format::R8G8B8A8Snorm || mask >> byte & 1 == 1 {
            stored[byte] = *new;
        }
    }
}

/// A logic operation by its truth table: the result is bit `2 s + d` of the operation's entry.
fn logic_byte(op: LogicOp, s: u8, d: u8) -> u8 {
    const TABLE: [u8; 16] = [
        0b0000, 0b1000, 0b0100, 0b1100, 0b0010, 0b1010, 0b0110, 0b1110, 0b0001, 0b1001, 0b0101, 0b1101, 0b0011, 0b1011,
        0b0111, 0b1111,
    ];
    let table = TABLE[LOGIC_OPS.iter().position(|&other| other == op).unwrap()];
    (0..8).fold(0, |out, bit| {
        let entry = (s >> bit & 1) << 1 | d >> bit & 1;
        out | (table >> entry & 1) << bit
    })
}

/// Renders the scene on a device.
fn render(scene: &Scene, config: &Config) -> Picture {
    let target = image(scene.color, scene.samples, 1);
    let depth = scene.depth.map(|format| image(format, scene.samples, 1));
    let value = ClearValue::DepthStencil { depth: CLEAR_DEPTH, stencil: CLEAR_STENCIL };
    let stencil = depth.as_ref().filter(|view| view.format.plane(Aspect::Stencil).is_some());
    let rendering = Rendering {
        area: EVERYTHING,
        layer_count: 1,
        view_mask: 0,
        color: vec![Some(attachment(&target, color_clear(scene)))],
        depth: depth.as_ref().map(|view| attachment(view, value)),
        stencil: stencil.map(|view| attachment(view, value)),
    };
    let counters = run(config, &rendering, |device| {
        let draws = scene.draws.iter().map(|scene_draw| {
            let mut inputs = varyings(10, Interpolation::Flat, Sampling::Center);
            let mut outputs = [color(0, 0), color(0, 1)].concat();
            if scene_draw.writes_depth {
                inputs.swap(8, 9);
                outputs.push(FragmentOutput::Depth);
            }
            if scene_draw.writes_stencil_reference {
                // The output is a copy of the input that also kills, which must come twice.
                let kill =
                    FragmentInput::Varying { index: 8, interpolation: Interpolation::Flat, sampling: Sampling::Center };
                inputs.insert(outputs.len(), kill);
                outputs.push(FragmentOutput::StencilReference);
            }
            let mut stage = fragments(inputs, outputs, scene_draw.discards);
            stage.early_tests = scene_draw.early_tests;
            // Only provoking vertices matter.
            let values = scene_draw.values.iter().flat_map(|values| {
                let mut all = [[0x7FC0_1234; 10]; 3];
                all[0] = *values;
                all.into_iter().flatten()
            });
            let (state, primitives) = (scene_draw.state.clone(), scene_draw.primitives.clone());
            draw(device, Some(stage), state, primitives, values.collect(), 10)
        });
        draws.collect()
    });
    let mut picture = Picture {
        color: Vec::new(),
        depth: Vec::new(),
        stencil: Vec::new(),
        passed: counters.get(Counter::SamplesPassed),
    };
    for at in 0..WIDTH * HEIGHT * scene.samples {
        let (pixel, sample) = (at / scene.samples, at % scene.samples);
        let place = [pixel % WIDTH, pixel / WIDTH];
        picture.color.push(texel(&target, Aspect::Color, 0, sample, place));
        picture.depth.push(depth.as_ref().map_or(0, |view| {
            let mut bytes = texel(view, Aspect::Depth, 0, sample, place);
            bytes.resize(4, 0);
            u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
        }));
        picture.stencil.push(stencil.map_or(0, |view| texel(view, Aspect::Stencil, 0, sample, place)[0]));
    }
    picture
}

#[gaurast_runner::test(each = simd_levels())]
fn random_states_agree_with_the_twin_whatever_the_configuration(case: &Case) {
    let configs = configs(level_of(case));
    for seed in 0..48 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let scene = scene(&mut rng);
        let expected = naive(&scene);
        for config in &configs {
            let found = render(&scene, config);
            for at in 0..expected.color.len() {
                let of = |p: &Picture| (p.color[at].clone(), p.depth[at], p.stencil[at]);
                assert_eq!(
                    of(&found),
                    of(&expected),
                    "seed {seed}, {:?}, {:?}, {} samples, sample {at}, {config:?}, {:#?}",
                    scene.color,
                    scene.depth,
                    scene.samples,
                    scene.draws.iter().map(|d| (&d.state, d.discards, d.early_tests)).collect::<Vec<_>>()
                );
            }
            assert_eq!(found.passed, expected.passed, "seed {seed}, {config:?}");
        }
    }
}
