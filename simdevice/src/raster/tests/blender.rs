//! Blending of one fragment (Vulkan 1.3, 29.1): the naive reference for [`crate::raster::color`].

use crate::format::Format;
use crate::raster::color::clamp_range;
use crate::state::{BlendEquation, BlendEquations, BlendFactor, BlendOp, BlendState};

/// The blending of one attachment, prepared for many fragments.
#[derive(Clone, Debug)]
pub struct Blender {
    equations: Option<BlendEquations>,
    constants: [f32; 4],
    /// The range to which sources, destinations and constants are clamped.
    range: Option<(f32, f32)>,
    write: [bool; 4],
}

impl Blender {
    /// Prepares `state` for an attachment of `format`.
    pub fn new(state: &BlendState, constants: [f32; 4], format: Format) -> Self {
        let range = clamp_range(format);
        Self {
            // Integers are never blended.
            equations: state.equations.filter(|_| !format.is_integer()),
            constants: clamp(constants, range),
            range,
            write: std::array::from_fn(|component| state.write_mask >> component & 1 == 1),
        }
    }

    /// Blends `source` with `destination`, without quantization to the format.
    pub fn blend(&self, source: [f32; 4], destination: [f32; 4]) -> [f32; 4] {
        self.blend_dual(source, [0.0; 4], destination)
    }

    /// Blends as [`Blender::blend`] does, with the second source of dual-source blending.
    pub fn blend_dual(&self, source: [f32; 4], second: [f32; 4], destination: [f32; 4]) -> [f32; 4] {
        let blended = match self.equations {
            None => source,
            Some(BlendEquations { color, alpha }) => {
                let (s, d) = (clamp(source, self.range), clamp(destination, self.range));
                let second = clamp(second, self.range);
                let [r, g, b, _] = evaluate(color, s, second, d, self.constants);
                let [.., a] = evaluate(alpha, s, second, d, self.constants);
                [r, g, b, a]
            }
        };
        std::array::from_fn(|component| if self.write[component] { blended[component] } else { destination[component] })
    }
}

fn clamp(color: [f32; 4], range: Option<(f32, f32)>) -> [f32; 4] {
    match range {
        Some((low, high)) => color.map(|component| component.clamp(low, high)),
        None => color,
    }
}

/// Evaluates a blend equation.
fn evaluate(equation: BlendEquation, s: [f32; 4], second: [f32; 4], d: [f32; 4], constants: [f32; 4]) -> [f32; 4] {
    let term = |value: [f32; 4], by: BlendFactor| {
        // A factor of zero removes a term whatever its value, infinities and NaNs included.
        if by == BlendFactor::Zero {
            return [0.0; 4];
        }
        let factors = factors(by, s, second, d, constants);
        std::array::from_fn::<f32, 4, _>(|component| value[component] * factors[component])
    };
    let (source, destination) = match equation.op {
        BlendOp::Min | BlendOp::Max => (s, d),
        _ => (term(s, equation.source), term(d, equation.destination)),
    };
    std::array::from_fn(|component| {
        let (s, d) = (source[component], destination[component]);
        match equation.op {
            BlendOp::Add => s + d,
            BlendOp::Subtract => s - d,
            BlendOp::ReverseSubtract => d - s,
            BlendOp::Min => s.min(d),
            BlendOp::Max => s.max(d),
        }
    })
}

/// The factor of each component.
fn factors(factor: BlendFactor, s: [f32; 4], second: [f32; 4], d: [f32; 4], constants: [f32; 4]) -> [f32; 4] {
    let inverse = |of: [f32; 4]| of.map(|component| 1.0 - component);
    match factor {
        BlendFactor::Zero => [0.0; 4],
        BlendFactor::One => [1.0; 4],
        BlendFactor::SrcColor => s,
        BlendFactor::OneMinusSrcColor => inverse(s),
        BlendFactor::DstColor => d,
        BlendFactor::OneMinusDstColor => inverse(d),
        BlendFactor::SrcAlpha => [s[3]; 4],
        BlendFactor::OneMinusSrcAlpha => [1.0 - s[3]; 4],
        BlendFactor::DstAlpha => [d[3]; 4],
        BlendFactor::OneMinusDstAlpha => [1.0 - d[3]; 4],
        BlendFactor::ConstantColor => constants,
        BlendFactor::OneMinusConstantColor => inverse(constants),
        BlendFactor::ConstantAlpha => [constants[3]; 4],
        BlendFactor::OneMinusConstantAlpha => [1.0 - constants[3]; 4],
        BlendFactor::SrcAlphaSaturate => {
            let least = s[3].min(1.0 - d[3]);
            [least, least, least, 1.0]
        }
        BlendFactor::Src1Color => second,
        BlendFactor::OneMinusSrc1Color => inverse(second),
        BlendFactor::Src1Alpha => [second[3]; 4],
        BlendFactor::OneMinusSrc1Alpha => [1.0 - second[3]; 4],
    }
}

mod tests {
    use super::*;

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
    const OPS: [BlendOp; 5] = [BlendOp::Add, BlendOp::Subtract, BlendOp::ReverseSubtract, BlendOp::Min, BlendOp::Max];
    const CONSTANTS: [f32; 4] = [0.2, 1.5, -0.25, 0.75];

    /// The factors of a blend equation in binary64, as in the specification's table.
    fn model_factor(f: BlendFactor, s: [f64; 4], s1: [f64; 4], d: [f64; 4], c: [f64; 4]) -> [f64; 4] {
        let all = |x: f64| [x; 4];
        let inverse = |v: [f64; 4]| v.map(|x| 1.0 - x);
        match f {
            BlendFactor::Zero => all(0.0),
            BlendFactor::One => all(1.0),
            BlendFactor::SrcColor => s,
            BlendFactor::OneMinusSrcColor => inverse(s),
            BlendFactor::DstColor => d,
            BlendFactor::OneMinusDstColor => inverse(d),
            BlendFactor::SrcAlpha => all(s[3]),
            BlendFactor::OneMinusSrcAlpha => inverse(all(s[3])),
            BlendFactor::DstAlpha => all(d[3]),
            BlendFactor::OneMinusDstAlpha => inverse(all(d[3])),
            BlendFactor::ConstantColor => c,
            BlendFactor::OneMinusConstantColor => inverse(c),
            BlendFactor::ConstantAlpha => all(c[3]),
            BlendFactor::OneMinusConstantAlpha => inverse(all(c[3])),
            BlendFactor::SrcAlphaSaturate => {
                let f = s[3].min(1.0 - d[3]);
                [f, f, f, 1.0]
            }
            BlendFactor::Src1Color => s1,
            BlendFactor::OneMinusSrc1Color => inverse(s1),
            BlendFactor::Src1Alpha => all(s1[3]),
            BlendFactor::OneMinusSrc1Alpha => inverse(all(s1[3])),
        }
    }

    fn model(e: BlendEquation, s: [f64; 4], s1: [f64; 4], d: [f64; 4], c: [f64; 4]) -> [f64; 4] {
        let fs = model_factor(e.source, s, s1, d, c);
        let fd = model_factor(e.destination, s, s1, d, c);
        std::array::from_fn(|i| match e.op {
            BlendOp::Add => s[i] * fs[i] + d[i] * fd[i],
            BlendOp::Subtract => s[i] * fs[i] - d[i] * fd[i],
            BlendOp::ReverseSubtract => d[i] * fd[i] - s[i] * fs[i],
            BlendOp::Min => s[i].min(d[i]),
            BlendOp::Max => s[i].max(d[i]),
        })
    }

    fn blender(color: BlendEquation, alpha: BlendEquation, format: Format) -> Blender {
        let state = BlendState { equations: Some(BlendEquations { color, alpha }), write_mask: 0xF };
        Blender::new(&state, CONSTANTS, format)
    }

    /// Compares every pair of factors and every operation with the model. Operands are clamped to `range` if there is
    /// one.
    fn compare(format: Format, range: Option<(f64, f64)>) {
        let wide = |v: [f32; 4]| {
            v.map(|x| match range {
                Some((low, high)) => f64::from(x).clamp(low, high),
                None => f64::from(x),
            })
        };
        let source = [0.3, 1.25, -0.5, 0.6];
        let second = [0.7, -0.2, 1.1, 0.35];
        let destination = format.decode(&format.encode([0.9, 0.1, 0.45, 0.7]));
        let alpha = BlendEquation {
            source: BlendFactor::DstAlpha,
            destination: BlendFactor::One,
            op: BlendOp::ReverseSubtract,
        };
        for s in FACTORS {
            for d in FACTORS {
                for op in OPS {
                    let color = BlendEquation { source: s, destination: d, op };
                    let blended = blender(color, alpha, format).blend_dual(source, second, destination);
                    let (s, d, c) = (wide(source), wide(destination), wide(CONSTANTS));
                    let s1 = wide(second);
                    let (rgb, a) = (model(color, s, s1, d, c), model(alpha, s, s1, d, c));
                    let expected = [rgb[0], rgb[1], rgb[2], a[3]];
                    for (blended, expected) in blended.into_iter().zip(expected) {
                        let error = (f64::from(blended) - expected).abs();
                        assert!(error <= 4e-7, "{format:?} {color:?}: {blended} {expected}");
                    }
                }
            }
        }
    }

    #[gaurast_runner::test]
    fn every_equation_agrees_with_the_specification() {
        compare(Format::R32G32B32A32Sfloat, None);
        compare(Format::R8G8B8A8Unorm, Some((0.0, 1.0)));
        compare(Format::R8G8B8A8Srgb, Some((0.0, 1.0)));
        compare(Format::R8G8B8A8Snorm, Some((-1.0, 1.0)));
    }

    #[gaurast_runner::test]
    fn masked_components_and_zero_factors_keep_nothing_they_should_not() {
        let replace = BlendEquation { source: BlendFactor::One, destination: BlendFactor::Zero, op: BlendOp::Add };
        let state = BlendState { equations: Some(BlendEquations::both(replace)), write_mask: 0b0101 };
        let blender = Blender::new(&state, CONSTANTS, Format::R32G32B32A32Sfloat);
        let blended = blender.blend([1.0, 2.0, 3.0, 4.0], [f32::INFINITY, 6.0, f32::NAN, 8.0]);
        assert_eq!(blended, [1.0, 6.0, 3.0, 8.0]);
    }
}
