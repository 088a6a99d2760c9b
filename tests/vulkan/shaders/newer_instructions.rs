//! Instructions and execution modes that newer extensions brought. The compiler of GLSL writes older ones, for which the
//! tests put the newer.

use gaurast_testkit::for_levels::levels;
use gaurast_testkit::newer::{Flags, instruction, result_of, rewritten};
use gaurast_testkit::shader::{GLSLANG, Stage, compile};
use gaurast_testkit::{
    Bindings, Buffer, Driver, Gpu, Graphics, Kernel, Opening, Pass, Resource, Settings, Shader, Target,
};
use std::ffi::CStr;

use ash::vk;
use spirv::{Capability, Decoration, ExecutionMode, Op};

/// The lanes of a workgroup.
const LANES: u32 = 64;

/// Devices of each SIMD level, with extensions and their features.
fn of_each_level<T: vk::ExtendsDeviceCreateInfo>(
    extensions: &'static [&'static CStr],
    features: impl Fn() -> T,
) -> impl Iterator<Item = Gpu> {
    levels().into_iter().map(move |level| {
        let settings = Settings { simd: Some(level), ..Settings::DEFAULT };
        let opening = Opening { settings, extensions, ..Opening::of(Driver::Embedded) };
        Gpu::open_with(&opening, &mut features()).expect("a device")
    })
}

/// Runs a kernel of one workgroup whose binding 0 is a buffer of these words, and returns them. Nothing may be warned of.
fn run(gpu: &Gpu, words: &[u32], contents: &[u32], push: &[u32]) -> Vec<u32> {
    let buffer = Buffer::of(gpu, contents);
    let bindings = Bindings::new(gpu, &[Resource::Storage(buffer.raw)]);
    let kernel = Kernel::over(gpu, words, &[bindings.layout]);
    kernel.run(&[bindings.set], push, [1, 1, 1]);
    assert_eq!(gpu.message_texts(), [""; 0]);
    buffer.values()
}

/// Values of two components are rotated within the subgroup, and within clusters of eight lanes.
#[gaurast_runner::test(needs = [GLSLANG])]
fn values_are_rotated_within_subgroups_and_clusters() {
    let source = format!(
        "#extension GL_KHR_shader_subgroup_basic : require
        #extension GL_KHR_shader_subgroup_shuffle : require
        #extension GL_KHR_shader_subgroup_shuffle_relative : require
        layout(local_size_x = {LANES}) in;
        layout(binding = 0) buffer Values {{ uint values[]; }};
        layout(push_constant) uniform Push {{ uint delta; }};
        void main() {{
            uint lane = gl_SubgroupInvocationID;
            uvec2 value = uvec2(100, 1000) + lane;
            uvec2 rotated = subgroupShuffleXor(value, delta);
            uint of_cluster = subgroupShuffleUp(value.x, delta);
            uint at = 4 * gl_LocalInvocationIndex;
            values[at] = gl_SubgroupSize * 8u;
            values[at + 1] = rotated.x;
            values[at + 2] = rotated.y;
            values[at + 3] = of_cluster;
        }}"
    );
    let words = compile(Stage::Compute, &source);
    let eight = result_of(&words, Op::Constant, 2, |own| own[3] == 8);
    let words = rewritten(&words, &[Capability::GroupNonUniformRotateKHR], |op, own, into| {
        let clusters: &[u32] = match op {
            Op::GroupNonUniformShuffleXor => &[],
            Op::GroupNonUniformShuffleUp => &[eight],
            _ => return false,
        };
        into.extend(instruction(Op::GroupNonUniformRotateKHR, &[&own[1..], clusters].concat()));
        true
    });
    let features = || {
        vk::PhysicalDeviceShaderSubgroupRotateFeaturesKHR::default()
            .shader_subgroup_rotate(true)
            .shader_subgroup_rotate_clustered(true)
    };
    let gpus: Vec<Gpu> = of_each_level(&[ash::khr::shader_subgroup_rotate::NAME], features).collect();
    for (gpu, delta) in gpus.iter().flat_map(|gpu| [0, 1, 5, 8, 31, 63].map(|delta| (gpu, delta))) {
        let found = run(gpu, &words, &[0; 4 * LANES as usize], &[delta]);
        for (lane, found) in (0..).zip(found.as_chunks::<4>().0) {
            let size = found[0] / 8;
            assert!(size >= 4, "{size}");
            let lane = lane % size;
            let from = (lane + delta) % size;
            let of_cluster = lane - lane % 8 + (lane + delta) % 8;
            assert_eq!(found[1..], [100 + from, 1000 + from, 100 + of_cluster], "lane {lane} by {delta}");
        }
    }
}

/// Devices of each SIMD level with votes of quads.
fn with_quads() -> impl Iterator<Item = Gpu> {
    const NAMES: [&CStr; 2] = [ash::khr::shader_quad_control::NAME, ash::khr::shader_maximal_reconvergence::NAME];
    of_each_level(&NAMES, || vk::PhysicalDeviceShaderQuadControlFeaturesKHR::default().shader_quad_control(true))
}

/// Lanes of a quad vote. One of them is inactive in half of the quads, and has no vote there.
#[gaurast_runner::test(needs = [GLSLANG])]
fn quads_vote() {
    let source = format!(
        "#extension GL_KHR_shader_subgroup_vote : require
        layout(local_size_x = {LANES}) in;
        layout(binding = 0) buffer Values {{ uint values[]; }};
        void main() {{
            uint lane = gl_LocalInvocationIndex;
            bool mine = values[lane] != 0;
            uint votes = 0;
            if (lane % 8 != 3)
                votes = (subgroupAll(mine) ? 1u : 0u) + (subgroupAny(mine) ? 2u : 0u);
            values[lane] = votes;
        }}"
    );
    let words = compile(Stage::Compute, &source);
    let words = rewritten(&words, &[Capability::QuadControlKHR], |op, own, into| {
        let op = match op {
            Op::GroupNonUniformAll => Op::GroupNonUniformQuadAllKHR,
            Op::GroupNonUniformAny => Op::GroupNonUniformQuadAnyKHR,
            _ => return false,
        };
        // Without the scope.
        into.extend(instruction(op, &[own[1], own[2], own[4]]));
        true
    });
    // Quad n has the lowest bits of n.
    let mine: Vec<u32> = (0..LANES).map(|lane| ((lane / 4) >> (lane % 4)) & 1).collect();
    for gpu in with_quads() {
        let found = run(&gpu, &words, &mine, &[]);
        for lane in 0..LANES {
            let votes = |own: u32| lane / 4 == own / 4 && own % 8 != 3;
            let voters: Vec<u32> = (0..LANES).filter(|&own| votes(own)).map(|own| mine[own as usize]).collect();
            let (all, any) = (voters.iter().all(|&vote| vote == 1), voters.contains(&1));
            let expected = if votes(lane) { u32::from(all) + 2 * u32::from(any) } else { 0 };
            assert_eq!(found[lane as usize], expected, "lane {lane}");
        }
    }
}

/// Fragments of quads that a triangle covers in part hear their helpers' votes: helpers run in all of them.
#[gaurast_runner::test(needs = [GLSLANG])]
fn helpers_vote_in_full_quads() {
    const SIDE: usize = 32;
    let fragment = compile(
        Stage::Fragment,
        "#extension GL_KHR_shader_subgroup_vote : require
        layout(location = 0) out vec4 color;
        void main() { color = vec4(1.0, subgroupAny(gl_HelperInvocation) ? 1.0 : 0.0, 0.0, 1.0); }",
    );
    let fragment = rewritten(&fragment, &[Capability::QuadControlKHR], |op, own, into| match op {
        Op::GroupNonUniformAny => {
            into.extend(instruction(Op::GroupNonUniformQuadAnyKHR, &[own[1], own[2], own[4]]));
            true
        }
        Op::ExecutionMode => {
            into.extend_from_slice(own);
            for mode in [ExecutionMode::RequireFullQuadsKHR, ExecutionMode::QuadDerivativesKHR] {
                into.extend(instruction(Op::ExecutionMode, &[own[1], mode as u32]));
            }
            true
        }
        _ => false,
    });
    let vertex = compile(
        Stage::Vertex,
        "void main() {
            gl_Position = vec4(1.7 * (gl_VertexIndex & 1) - 0.9, 1.6 * (gl_VertexIndex >> 1) - 0.8, 0.0, 1.0);
        }",
    );
    for gpu in with_quads() {
        let target = Target::floats(&gpu, [SIDE as u32; 2]);
        let graphics = Graphics {
            shaders: vec![Shader::vertex(vertex.clone()), Shader::fragment(fragment.clone())],
            ..Default::default()
        };
        let pipeline = graphics.create(&gpu).expect("a pipeline");
        gpu.run(|commands| {
            commands.pass(&target, &Pass::zeros(), || {
                commands.bind(&pipeline);
                commands.draw(0..3);
            });
        });
        assert_eq!(gpu.message_texts(), [""; 0]);
        let pixels: Vec<[f32; 4]> = target.read();
        let covered = |x: usize, y: usize| pixels[y * SIDE + x][0] == 1.0;
        let mut partly = 0;
        for (y, x) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (y, x))).filter(|&(y, x)| covered(x, y)) {
            let quad = [0, 1].map(|dy| [0, 1].map(|dx| covered(x / 2 * 2 + dx, y / 2 * 2 + dy)));
            let has_helper = quad.as_flattened().contains(&false);
            partly += u32::from(has_helper);
            assert_eq!(pixels[y * SIDE + x][1] == 1.0, has_helper, "{x}, {y}");
        }
        assert!(partly > 20, "{partly}");
    }
}

/// Expected values and assumptions change nothing.
#[gaurast_runner::test(needs = [GLSLANG])]
fn expectations_change_nothing() {
    let source = format!(
        "layout(local_size_x = {LANES}) in;
        layout(binding = 0) buffer Values {{ uint values[]; }};
        void main() {{
            uint lane = gl_LocalInvocationIndex;
            uint expected = values[lane] & 7u;
            values[lane] = lane < 1000u ? expected : 0u;
        }}"
    );
    let words = compile(Stage::Compute, &source);
    let mut replaced = 0;
    let words = rewritten(&words, &[Capability::ExpectAssumeKHR], |op, own, into| match op {
        Op::BitwiseAnd => {
            replaced += 1;
            into.extend(instruction(Op::ExpectKHR, &own[1..]));
            true
        }
        Op::ULessThan => {
            replaced += 1;
            into.extend_from_slice(own);
            into.extend(instruction(Op::AssumeTrueKHR, &[own[2]]));
            true
        }
        _ => false,
    });
    assert_eq!(replaced, 2);
    let contents: Vec<u32> = (0..LANES).map(|lane| 3 * lane).collect();
    let features = || vk::PhysicalDeviceShaderExpectAssumeFeaturesKHR::default().shader_expect_assume(true);
    for gpu in of_each_level(&[ash::khr::shader_expect_assume::NAME], features) {
        assert_eq!(run(&gpu, &words, &contents, &[]), contents);
    }
}

/// A vector, an array and a constant are made of one part each.
#[gaurast_runner::test(needs = [GLSLANG])]
fn composites_are_made_of_one_part() {
    let source = "
        layout(local_size_x = 1) in;
        layout(binding = 0) buffer Values { uint values[]; };
        void main() {
            const uvec2 pairs[3] = uvec2[3](uvec2(5u), uvec2(5u), uvec2(5u));
            uvec3 three = uvec3(values[0]);
            uvec4 all = uvec4(values[2]);
            uvec4 constant = all + uvec4(7u);
            for (uint at = 0; at < 3; at++) { values[2 * at] = pairs[at].x + three[at]; values[2 * at + 1] = pairs[at].y; }
            for (uint at = 0; at < 4; at++) values[6 + at] = constant[at];
        }";
    let words = compile(Stage::Compute, source);
    let (mut made, mut constants) = (0, 0);
    let words = rewritten(&words, &[Capability::ReplicatedCompositesEXT], |op, own, into| {
        let is_of_one = own.len() > 4 && own[3..].iter().all(|part| *part == own[3]);
        let op = match op {
            Op::CompositeConstruct if is_of_one => {
                made += 1;
                Op::CompositeConstructReplicateEXT
            }
            Op::ConstantComposite if is_of_one => {
                constants += 1;
                Op::ConstantCompositeReplicateEXT
            }
            _ => return false,
        };
        into.extend(instruction(op, &own[1..4]));
        true
    });
    assert!(made >= 2 && constants >= 3, "{made}, {constants}");
    let features = || Flags::<1_000_564_000, 1>::new([vk::TRUE]);
    for gpu in of_each_level(&[c"VK_EXT_shader_replicated_composites"], features) {
        let found = run(&gpu, &words, &[10, 0, 30, 0, 0, 0, 0, 0, 0, 0], &[]);
        assert_eq!(found, [15, 5, 15, 5, 15, 5, 37, 37, 37, 37]);
    }
}

/// A product and a sum are one instruction unless a decoration, or the default of their type, says otherwise; and a
/// decoration overrides the default.
#[gaurast_runner::test(needs = [GLSLANG])]
fn fast_math_modes_say_what_is_contracted() {
    let source = "
        layout(local_size_x = 1) in;
        layout(binding = 0) buffer Values { float values[]; };
        layout(push_constant) uniform Push { uint zero; };
        void main() {
            float product = values[0] * values[1];
            values[3] = product + values[2];
        }";
    let words = compile(Stage::Compute, source);
    let int = result_of(&words, Op::TypeInt, 1, |_| true);
    let float = result_of(&words, Op::TypeFloat, 1, |_| true);
    let results = [Op::FMul, Op::FAdd].map(|op| result_of(&words, op, 2, |_| true));
    let bound = words[3];
    let with = |decorated: Option<u32>, default: Option<u32>| {
        let mut words = rewritten(&words, &[Capability::FloatControls2], |op, own, into| match op {
            Op::ExecutionMode => {
                into.extend_from_slice(own);
                if default.is_some() {
                    let operands = [own[1], ExecutionMode::FPFastMathDefault as u32, float, bound];
                    into.extend(instruction(Op::ExecutionModeId, &operands));
                }
                true
            }
            Op::TypeVoid => {
                for id in results.into_iter().filter(|_| decorated.is_some()) {
                    let operands = [id, Decoration::FPFastMathMode as u32, decorated.unwrap_or(0)];
                    into.extend(instruction(Op::Decorate, &operands));
                }
                into.extend_from_slice(own);
                true
            }
            Op::TypeInt if own[1] == int => {
                into.extend_from_slice(own);
                into.extend(instruction(Op::Constant, &[int, bound, default.unwrap_or(0)]));
                true
            }
            _ => false,
        });
        words[3] = bound + 1;
        words
    };
    const CONTRACT: u32 = 0x10000;
    let near = 1.0f32 + 2f32.powi(-12);
    let sum = -(1.0 + 2f32.powi(-11));
    let fused = near.mul_add(near, sum);
    assert_ne!(near * near + sum, fused);
    let cases = [
        (None, None, true),
        (Some(0), None, false),
        (Some(CONTRACT), None, true),
        (None, Some(0), false),
        (None, Some(CONTRACT), true),
        (Some(CONTRACT), Some(0), true),
        (Some(0), Some(CONTRACT), false),
    ];
    let features = || vk::PhysicalDeviceShaderFloatControls2FeaturesKHR::default().shader_float_controls2(true);
    let gpus: Vec<Gpu> = of_each_level(&[ash::khr::shader_float_controls2::NAME], features).collect();
    for (gpu, (decorated, default, is_fused)) in gpus.iter().flat_map(|gpu| cases.map(|case| (gpu, case))) {
        let found = run(gpu, &with(decorated, default), &[near, near, sum, 0.0].map(f32::to_bits), &[0]);
        let expected = if is_fused { fused } else { near * near + sum };
        assert_eq!(f32::from_bits(found[3]), expected, "{decorated:?}, {default:?}");
    }
}

/// Debug information may refer to what follows it.
#[gaurast_runner::test(needs = [GLSLANG])]
fn extended_instructions_may_refer_forward() {
    let mut features = Flags::<1_000_558_000, 1>::new([vk::TRUE]);
    let gpu = Gpu::extended(&[c"VK_KHR_shader_relaxed_extended_instruction"], &mut features).expect("a device");
    let source = "
        #extension GL_EXT_debug_printf : require
        layout(local_size_x = 1) in;
        layout(binding = 0) buffer Values { uint values[]; };
        void main() {
            debugPrintfEXT(\"%u\", values[0]);
            values[0] += 5u;
        }";
    let mut replaced = 0;
    let words = rewritten(&compile(Stage::Compute, source), &[], |op, own, into| {
        if op != Op::ExtInst {
            return false;
        }
        replaced += 1;
        into.extend(instruction(Op::ExtInstWithForwardRefsKHR, &own[1..]));
        true
    });
    assert_eq!(replaced, 1);
    assert_eq!(run(&gpu, &words, &[3], &[]), [8]);
}

/// Lanes that part in a loop, a selection, a switch or a function meet at its end: ballots count them.
#[gaurast_runner::test(needs = [GLSLANG])]
fn lanes_that_part_meet_again() {
    let source = format!(
        "#extension GL_KHR_shader_subgroup_ballot : require
        layout(local_size_x = {LANES}) in;
        layout(binding = 0) buffer Values {{ uint values[]; }};
        uint here() {{ return subgroupBallotBitCount(subgroupBallot(true)); }}
        uint early(uint lane) {{
            if (lane % 2 == 1) return here();
            return 100 + here();
        }}
        void main() {{
            uint lane = gl_SubgroupInvocationID;
            uint at = 8 * gl_LocalInvocationIndex;
            values[at] = gl_SubgroupSize;
            uint sum = 0;
            for (uint i = 0; ; i++) {{
                sum += here();
                if (i == lane % 5) break;
                if (lane % 2 == 0) continue;
                sum += 1000 * here();
            }}
            values[at + 1] = sum;
            values[at + 2] = here();
            values[at + 3] = early(lane);
            values[at + 4] = here();
            uint inner = 0;
            switch (lane % 3) {{
                case 0: inner = here(); break;
                case 1: if (lane % 2 == 0) {{ inner = here(); break; }} inner = 200 + here(); break;
                default: inner = 300 + here();
            }}
            values[at + 5] = inner;
            values[at + 6] = here();
        }}"
    );
    let words = rewritten(&compile(Stage::Compute, &source), &[], |op, own, into| {
        if op == Op::ExecutionMode {
            let mode = ExecutionMode::MaximallyReconvergesKHR as u32;
            into.extend(instruction(Op::ExecutionMode, &[own[1], mode]));
        }
        false
    });
    let features = || vk::PhysicalDeviceShaderMaximalReconvergenceFeaturesKHR {
        shader_maximal_reconvergence: vk::TRUE,
        ..Default::default()
    };
    let found: Vec<u32> = of_each_level(&[ash::khr::shader_maximal_reconvergence::NAME], features)
        .flat_map(|gpu| run(&gpu, &words, &[0; 8 * LANES as usize], &[]))
        .collect();
    for (index, found) in (0..).zip(found.as_chunks::<8>().0) {
        let size = found[0];
        let lane = index % size;
        let count = |is_there: &dyn Fn(u32) -> bool| (0..size).filter(|&lane| is_there(lane)).count() as u32;
        let sum: u32 = (0..=lane % 5)
            .map(|i| {
                let first = count(&|other| other % 5 >= i);
                let second = count(&|other| other % 5 > i && other % 2 == 1);
                first + if lane % 2 == 1 && lane % 5 > i { 1000 * second } else { 0 }
            })
            .sum();
        let early = if lane % 2 == 1 { size / 2 } else { 100 + size / 2 };
        let inner = match (lane % 3, lane % 2) {
            (0, _) => count(&|other| other % 3 == 0),
            (1, 0) => count(&|other| other % 6 == 4),
            (1, _) => 200 + count(&|other| other % 6 == 1),
            _ => 300 + count(&|other| other % 3 == 2),
        };
        assert_eq!(found[1..7], [sum, size, early, size, inner, size], "lane {lane}");
    }
}
