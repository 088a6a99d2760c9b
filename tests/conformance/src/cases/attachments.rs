//! Depth, stencil and multisampling; viewports, scissors, formats and blending.

use ash::vk;
use gaurast::vk::{GaussianGeometryGAURAST as Geometry, GaussianOrderGAURAST as Order};

use super::chapter::Chapter;
use super::scenes::{Gaussian, ball, cameras, dense, front, layered, many};
use crate::draw::{Blend, Call, Camera, ColorFormat, Depth, Draw, SIZE};

const OPERATIONS: [(&str, vk::CompareOp); 8] = [
    ("never", vk::CompareOp::NEVER),
    ("less", vk::CompareOp::LESS),
    ("equal", vk::CompareOp::EQUAL),
    ("less_or_equal", vk::CompareOp::LESS_OR_EQUAL),
    ("greater", vk::CompareOp::GREATER),
    ("not_equal", vk::CompareOp::NOT_EQUAL),
    ("greater_or_equal", vk::CompareOp::GREATER_OR_EQUAL),
    ("always", vk::CompareOp::ALWAYS),
];

const FORMATS: [(&str, vk::Format); 3] =
    [("d16", vk::Format::D16_UNORM), ("d24", vk::Format::X8_D24_UNORM_PACK32), ("d32", vk::Format::D32_SFLOAT)];

/// Depth coefficients that map a depth variable of 1 to depth 0 and 16 to depth 1, or the reverse.
fn coefficients(reverse: bool) -> [f32; 2] {
    if reverse { [-1.0 / 15.0, 16.0 / 15.0] } else { [16.0 / 15.0, -16.0 / 15.0] }
}

fn camera(reverse: bool) -> Camera {
    front().depth_coefficients(coefficients(reverse))
}

pub(super) fn tested(format: vk::Format, op: vk::CompareOp, write: bool) -> Depth {
    Depth { format, test: Some((op, write)), bounds: None, stencil: None, stripes: [2.5, 4.0, 6.0, 7.0, 9.0, 16.0] }
}

pub(super) fn with_depth(depth: Depth) -> Draw {
    Draw { depth: Some(depth), behind: [0.1, 0.2, 0.3, 0.4], ..Draw::new(layered(31, 0)) }.seen_by(camera(false))
}

fn viewport(x: f32, y: f32, width: f32, height: f32, depths: [f32; 2]) -> Option<vk::Viewport> {
    Some(vk::Viewport { x, y, width, height, min_depth: depths[0], max_depth: depths[1] })
}

pub(super) fn depth(chapter: &mut Chapter<'_>) {
    let [width, height] = SIZE.map(|side| side as f32);
    for (format_name, format) in FORMATS {
        for (name, op) in OPERATIONS {
            for reverse in [false, true] {
                let side = if reverse { "reverse" } else { "forward" };
                chapter.add(format!("{format_name}.{name}.{side}"), move || {
                    with_depth(tested(format, op, true)).seen_by(camera(reverse))
                });
            }
        }
        chapter
            .add(format!("{format_name}.not_written"), move || with_depth(tested(format, vk::CompareOp::LESS, false)));
        for depths in [[0.25, 0.875], [1.0, 0.5]] {
            chapter.add(format!("{format_name}.range_{}_{}", depths[0], depths[1]), move || Draw {
                viewport: viewport(0.0, 0.0, width, height, depths),
                ..with_depth(tested(format, vk::CompareOp::LESS, true))
            });
        }
        chapter.add(format!("{format_name}.bounds"), move || {
            with_depth(Depth { bounds: Some([0.7, 0.9]), ..tested(format, vk::CompareOp::LESS_OR_EQUAL, true) })
        });
        chapter.add(format!("{format_name}.untested"), move || {
            with_depth(Depth { test: None, ..tested(format, vk::CompareOp::NEVER, true) })
        });
    }
    for index in [5, 6, 7, 8, 9] {
        let (name, camera) = cameras()[index];
        let coefficients = if index < 7 { [0.0, 0.0625] } else { coefficients(false) };
        chapter.add(format!("through.{name}"), move || {
            let mut draw = with_depth(tested(vk::Format::D32_SFLOAT, vk::CompareOp::LESS, true))
                .seen_by(camera.depth_coefficients(coefficients));
            // The stored depths correspond to these depth variables.
            draw.depth.as_mut().expect("a depth").stripes = [1.0, 2.0, 3.0, 4.0, 6.0, 15.0];
            draw
        });
    }
    for (name, order) in
        [("radial_distance", Order::RADIAL_DISTANCE), ("primitive", Order::PRIMITIVE), ("per_pixel", Order::PER_PIXEL)]
    {
        for op in [vk::CompareOp::LESS, vk::CompareOp::GREATER] {
            chapter.add(format!("order.{name}.{op:?}").to_lowercase(), move || {
                with_depth(tested(vk::Format::D32_SFLOAT, op, true)).in_state(|state| state.order(order))
            });
        }
    }
    for op in [vk::CompareOp::LESS, vk::CompareOp::GREATER] {
        chapter.add(format!("surfel.{op:?}").to_lowercase(), move || {
            with_depth(tested(vk::Format::D32_SFLOAT, op, true))
                .in_state(|state| state.geometry(Geometry::GAUSSIAN_2D).low_pass_variance(0.5))
        });
    }
    for (name, opacity) in [("opaque", 0.95), ("half", 0.5), ("faint", 0.1)] {
        chapter.add(format!("median.{name}"), move || {
            let scene = many(40, |index| Gaussian {
                position: [0.0, 0.0, 2.0 + 0.25 * index as f32],
                scale: [1.0 + 0.1 * index as f32; 3],
                opacity,
                ..ball()
            });
            Draw {
                depth: Some(tested(vk::Format::D32_SFLOAT, vk::CompareOp::ALWAYS, true)),
                ..Draw::new(scene).seen_by(camera(false))
            }
        });
    }
    for samples in [2, 4, 8] {
        for (name, mask) in [("all", u32::MAX), ("some", 0b0101), ("one", 0b10)] {
            for (op_name, op) in [("less", vk::CompareOp::LESS), ("greater", vk::CompareOp::GREATER)] {
                chapter.add(format!("samples_{samples}.{name}.{op_name}"), move || Draw {
                    samples,
                    sample_mask: mask,
                    ..with_depth(tested(vk::Format::D32_SFLOAT, op, true))
                });
            }
        }
    }
}

pub(super) fn stencil(chapter: &mut Chapter<'_>) {
    use vk::StencilOp as Op;
    let operations = [
        ("keep", Op::KEEP),
        ("zero", Op::ZERO),
        ("replace", Op::REPLACE),
        ("increment_and_clamp", Op::INCREMENT_AND_CLAMP),
        ("decrement_and_clamp", Op::DECREMENT_AND_CLAMP),
        ("invert", Op::INVERT),
        ("increment_and_wrap", Op::INCREMENT_AND_WRAP),
        ("decrement_and_wrap", Op::DECREMENT_AND_WRAP),
    ];
    let always = vk::StencilOpState {
        fail_op: Op::KEEP,
        pass_op: Op::KEEP,
        depth_fail_op: Op::KEEP,
        compare_op: vk::CompareOp::ALWAYS,
        compare_mask: 0xff,
        write_mask: 0xff,
        reference: 5,
    };
    let mut add = |name: String, state: vk::StencilOpState, depth: vk::CompareOp| {
        chapter.add(name, move || {
            with_depth(Depth { stencil: Some(state), ..tested(vk::Format::D32_SFLOAT_S8_UINT, depth, true) })
        });
    };
    for (name, op) in operations {
        let state = vk::StencilOpState { pass_op: op, ..always };
        add(format!("pass.{name}"), state, vk::CompareOp::LESS);
        let state = vk::StencilOpState { depth_fail_op: op, ..always };
        add(format!("depth_fail.{name}"), state, vk::CompareOp::GREATER);
        let state = vk::StencilOpState { fail_op: op, compare_op: vk::CompareOp::LESS, ..always };
        add(format!("fail.{name}"), state, vk::CompareOp::LESS);
    }
    for (name, compare_op) in OPERATIONS {
        let state = vk::StencilOpState {
            compare_op,
            pass_op: Op::INCREMENT_AND_WRAP,
            fail_op: Op::INVERT,
            depth_fail_op: Op::ZERO,
            reference: 3,
            ..always
        };
        add(format!("compare.{name}"), state, vk::CompareOp::LESS_OR_EQUAL);
    }
    for (name, compare_mask, write_mask) in
        [("compared", 0b101, 0xff), ("written", 0xff, 0b11), ("none_written", 0xff, 0)]
    {
        let state = vk::StencilOpState {
            compare_op: vk::CompareOp::EQUAL,
            compare_mask,
            write_mask,
            pass_op: Op::INVERT,
            fail_op: Op::REPLACE,
            ..always
        };
        add(format!("masks.{name}"), state, vk::CompareOp::ALWAYS);
    }
}

pub(super) fn interactions(chapter: &mut Chapter<'_>) {
    let formats =
        [("float32", ColorFormat::Float32), ("float16", ColorFormat::Float16), ("unorm8", ColorFormat::Unorm8)];
    let blends = [("over", Blend::Over), ("replace", Blend::Replace), ("add", Blend::Add), ("under", Blend::Under)];
    // All formats can hold these values, at least nearly.
    let behind = [0.2, 0.4, 0.6, 0.8];
    for (format_name, format) in formats {
        for (blend_name, blend) in blends {
            chapter.add(format!("blend.{format_name}.{blend_name}"), move || Draw {
                format,
                blend,
                behind,
                ..Draw::new(dense(41, 1))
            });
        }
    }
    use vk::ColorComponentFlags as C;
    for (name, write_mask) in [("red", C::R), ("green_and_blue", C::G | C::B), ("alpha", C::A), ("none", C::empty())] {
        chapter.add(format!("write_mask.{name}"), move || Draw { write_mask, behind, ..Draw::new(dense(42, 0)) });
    }
    let whole = [0.0, 1.0];
    for (name, viewport) in [
        ("within", viewport(13.0, 21.0, 61.0, 47.0, whole)),
        ("upside_down", viewport(13.0, 68.0, 61.0, -47.0, whole)),
        ("beyond", viewport(-20.0, -9.0, 150.0, 120.0, whole)),
        ("across_the_edge", viewport(60.0, 50.0, 90.0, 70.0, whole)),
        ("one_pixel", viewport(50.0, 40.0, 1.0, 1.0, whole)),
        ("outside", viewport(200.0, 0.0, 60.0, 50.0, whole)),
    ] {
        for (camera_name, camera) in [cameras()[0], cameras()[5], cameras()[7], cameras()[9]] {
            chapter.add(format!("viewport.{name}.{camera_name}"), move || Draw {
                viewport,
                behind,
                ..Draw::new(dense(43, 0)).seen_by(camera)
            });
        }
    }
    // The oracle has no fractional viewports, so no slope of this scene may be clamped.
    let wide = front().focal_length([35.0; 2]).principal_point([30.5, 23.5]);
    for (name, viewport) in [
        ("corner", viewport(13.25, 20.625, 61.0, 47.0, whole)),
        ("half", viewport(12.5, 20.5, 61.0, 47.0, whole)),
        ("size", viewport(13.0, 21.0, 61.75, 47.25, whole)),
        ("upside_down", viewport(13.75, 68.25, 60.5, -47.5, whole)),
    ] {
        chapter.add(format!("viewport.fractions.{name}"), move || Draw {
            viewport,
            behind,
            ..Draw::new(dense(49, 0)).seen_by(wide)
        });
    }
    let rectangle = |x, y, width, height| {
        Some(vk::Rect2D { offset: vk::Offset2D { x, y }, extent: vk::Extent2D { width, height } })
    };
    for (name, scissor, area) in [
        ("scissor", rectangle(17, 5, 40, 61), None),
        ("scissor_of_nothing", rectangle(17, 5, 0, 0), None),
        ("scissor_beyond", rectangle(90, 70, 1000, 1000), None),
        ("area", None, rectangle(3, 7, 77, 40)),
        ("scissor_and_area", rectangle(17, 5, 40, 61), rectangle(31, 16, 60, 32)),
    ] {
        chapter.add(name, move || Draw { scissor, area, behind, ..Draw::new(dense(44, 0)) });
        chapter.add(format!("{name}.viewport"), move || Draw {
            scissor,
            area,
            behind,
            viewport: viewport(13.0, 21.0, 61.0, 47.0, whole),
            ..Draw::new(dense(45, 0))
        });
    }
    // Two sets over each other, and the same draws as one set.
    for merges in [false, true] {
        for (format_name, format) in formats {
            let name = if merges { "one_set" } else { "two_sets" };
            chapter.add(format!("{name}.{format_name}"), move || {
                let part = |first, count| Call::Draw { vertices: [first, count], instances: [0, 1] };
                Draw {
                    format,
                    behind,
                    calls: vec![part(0, 250), part(250, 250)],
                    merged: merges,
                    ..Draw::new(dense(46, 0))
                }
            });
        }
    }
    for samples in [2, 4, 8] {
        for (name, sample_mask) in [("all", u32::MAX), ("some", 0b0101), ("none", 0)] {
            chapter.add(format!("samples_{samples}.{name}"), move || Draw {
                samples,
                sample_mask,
                behind,
                ..Draw::new(dense(47, 0))
            });
        }
    }
    for size in [[1, 1], [16, 16], [17, 15], [64, 64], [200, 3]] {
        chapter.add(format!("size_{}x{}", size[0], size[1]), move || Draw { size, behind, ..Draw::new(dense(48, 0)) });
    }
}
