//! Functions of GLSL.std.450 on floats.

use super::float::{correct, correct_but_sign_of_zero, shape};
use super::rows::What::Glsl;
use super::rows::{each, row, whole};
use gaurast_tests::programs::inputs::Domain;
use gaurast_tests::programs::precision::{Format, Interval, Maybe, exactly, format};
use gaurast_tests::programs::types::{Kind, Ty};
use gaurast_tests::programs::{Body, Expect, Row};
use spirv::{GlslStd450Op as G, Op};
use std::f64::consts::PI;

pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for kind in Kind::FLOATS {
        rows.extend(rounding(kind));
        rows.extend(mixing(kind));
        rows.extend(roots(kind));
        rows.extend(split(kind));
        if kind != Kind::F64 {
            rows.extend(transcendental(kind));
        }
    }
    rows.extend(packing());
    rows
}

fn rounding(kind: Kind) -> Vec<Row> {
    let ty = shape(kind);
    type One = fn(f64) -> f64;
    let exact: [(G, One); 5] = [
        (G::RoundEven, f64::round_ties_even),
        (G::Trunc, f64::trunc),
        (G::FAbs, f64::abs),
        (G::Floor, f64::floor),
        (G::Ceil, f64::ceil),
    ];
    let mut rows: Vec<Row> = exact
        .into_iter()
        .map(|(op, model)| each(Glsl(op), &[ty], ty, move |v| correct(kind, model(kind.float(v[0])))))
        .collect();
    rows.extend([
        // A half may be rounded either way.
        each(Glsl(G::Round), &[ty], ty, move |v| {
            let x = kind.float(v[0]);
            // A half rounded down: the result for a slightly smaller number.
            let down = x.signum() * (x.abs() - 0.5).ceil();
            Expect::OneOf([x.round_ties_even(), x.round(), down].map(|x| kind.round(x)).to_vec())
        }),
        each(Glsl(G::FSign), &[ty], ty, move |v| match kind.float(v[0]) {
            0.0 => correct_but_sign_of_zero(kind, 0.0),
            x if x.is_nan() => Expect::Any,
            x => correct(kind, x.signum()),
        }),
        each(Glsl(G::Fract), &[ty], ty, move |v| {
            let x = kind.float(v[0]);
            let fraction = x - x.floor();
            match kind.round(fraction) {
                _ if !x.is_finite() => Expect::Any,
                // The result is less than one; a result that rounds to one may be the largest number below one.
                one if kind.float(one) == 1.0 => Expect::OneOf(vec![one, one - 1]),
                _ => correct_but_sign_of_zero(kind, fraction),
            }
        }),
        each(Glsl(G::Step), &[ty, ty], ty, move |v| {
            let (edge, x) = (kind.float(v[0]), kind.float(v[1]));
            match edge.is_nan() || x.is_nan() {
                true => Expect::Any,
                false => correct(kind, if x < edge { 0.0 } else { 1.0 }),
            }
        }),
    ]);
    rows
}

fn mixing(kind: Kind) -> Vec<Row> {
    let (ty, p) = (shape(kind), format(kind));
    let three = move |v: &[u64]| [0, 1, 2].map(|index| kind.float(v[index]));
    let mix = move |v: &[u64]| {
        let [x, y, a] = three(v);
        let formula = || {
            let rest = p.sub(exactly(1.0), exactly(a))?;
            let (left, right) = (p.mul(exactly(x), rest)?, p.mul(exactly(y), exactly(a))?);
            p.add(left, right)
        };
        p.inherited(x * (1.0 - a) + y * a, formula()).into()
    };
    let fma = move |v: &[u64]| {
        let [a, b, c] = three(v);
        let formula = p.mul(exactly(a), exactly(b)).and_then(|product| p.add(product, exactly(c)));
        p.inherited(a.mul_add(b, c), formula).into()
    };
    let smooth = move |v: &[u64]| {
        let [low, high, x] = three(v);
        if low.is_nan() || high.is_nan() || low >= high {
            return Expect::Any;
        }
        let formula = || {
            let top = p.sub(exactly(x), exactly(low))?;
            let t = p.rounded(p.div(top, p.sub(exactly(high), exactly(low))?)?);
            let t = Interval { low: t.low.clamp(0.0, 1.0), high: t.high.clamp(0.0, 1.0) };
            let slope = p.sub(exactly(3.0), p.mul(exactly(2.0), t)?)?;
            p.mul(p.mul(t, t)?, slope)
        };
        let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
        p.inherited(t * t * (3.0 - 2.0 * t), formula()).into()
    };
    let small = Domain::Floats(-4.0, 4.0);
    let operands = [ty, ty, ty];
    let near = |mut row: Row| {
        row.name += " of small numbers";
        row.of(0, small).of(1, small).of(2, small)
    };
    vec![
        each(Glsl(G::FMix), &operands, ty, mix),
        near(each(Glsl(G::FMix), &operands, ty, mix)),
        each(Glsl(G::Fma), &operands, ty, fma),
        near(each(Glsl(G::Fma), &operands, ty, fma)),
        each(Glsl(G::SmoothStep), &operands, ty, smooth),
        near(each(Glsl(G::SmoothStep), &operands, ty, smooth)),
    ]
}

fn roots(kind: Kind) -> Vec<Row> {
    let (ty, p) = (shape(kind), format(kind));
    let scaled = move |op: G, factor: f64| {
        // The constant factor may be rounded either way.
        let constant = p.rounded(exactly(factor));
        each(Glsl(op), &[ty], ty, move |v| {
            let x = kind.float(v[0]);
            p.inherited(x * factor, p.mul(exactly(x), constant)).into()
        })
    };
    vec![
        each(Glsl(G::Sqrt), &[ty], ty, move |v| {
            let x = kind.float(v[0]);
            p.inherited(x.sqrt(), p.sqrt(exactly(x))).into()
        }),
        each(Glsl(G::InverseSqrt), &[ty], ty, move |v| p.inverse_sqrt(exactly(kind.float(v[0]))).into()),
        scaled(G::Radians, PI / 180.0),
        scaled(G::Degrees, 180.0 / PI),
    ]
}

/// Instructions that split a float: significand and exponent, fraction and integer part.
fn split(kind: Kind) -> Vec<Row> {
    let ty = shape(kind);
    let exponents = ty.of(Kind::I32);
    let frexp = move |v: &[Vec<u64>]| -> Vec<Expect> {
        let one = |bits: &u64| frexp(kind, *bits);
        let both: Vec<_> = v[0].iter().map(one).collect();
        let first = both.iter().map(|both| both.0.clone());
        first.chain(both.iter().map(|both| both.1.clone())).collect()
    };
    let modf = move |v: &[Vec<u64>]| -> Vec<Expect> {
        let part = |model: fn(f64) -> f64| {
            v[0].iter().map(move |bits| match kind.float(*bits) {
                x if x.is_finite() => correct_but_sign_of_zero(kind, model(x)),
                _ => Expect::Any,
            })
        };
        part(f64::fract).chain(part(f64::trunc)).collect()
    };
    let both = |op: G, second: Ty, pointer: bool| {
        move |body: &mut Body, v: &[u32]| {
            let (first_ty, second_ty) = (body.ty(ty), body.ty(second));
            if pointer {
                let variable = body.asm.local(second_ty);
                let first = body.asm.glsl(op, first_ty, &[v[0], variable]);
                return vec![first, body.asm.emit(Op::Load, second_ty, &[variable])];
            }
            let parts = [first_ty, second_ty];
            let structure = body.asm.declare(Op::TypeStruct, None, &parts);
            let result = body.asm.glsl(op, structure, &[v[0]]);
            let part = |index: u32| (parts[index as usize], [result, index]);
            [part(0), part(1)].map(|(ty, operands)| body.asm.emit(Op::CompositeExtract, ty, &operands)).to_vec()
        }
    };
    // A variable of the module, and an array element that is indexed at run time.
    let through_array = move |body: &mut Body, v: &[u32]| {
        let whole_ty = body.ty(ty);
        let length = body.asm.u32(4);
        let array = body.asm.declare(Op::TypeArray, None, &[whole_ty, length]);
        let class = spirv::StorageClass::Private;
        let variable = body.asm.global(class, array);
        let pointer = body.asm.pointer(class, whole_ty);
        let place = body.asm.emit(Op::AccessChain, pointer, &[variable, v[1]]);
        let fraction = body.asm.glsl(G::Modf, whole_ty, &[v[0], place]);
        vec![fraction, body.asm.emit(Op::Load, whole_ty, &[place])]
    };
    let name = |what: &str| format!("Glsl{what} {kind:?}");
    let largest = match kind {
        Kind::F16 => 16,
        Kind::F32 => 128,
        _ => 1024,
    };
    vec![
        row(name("FrexpStruct"), &[ty], &[ty, exponents], both(G::FrexpStruct, exponents, false), frexp),
        row(name("Frexp"), &[ty], &[ty, exponents], both(G::Frexp, exponents, true), frexp),
        row(name("ModfStruct"), &[ty], &[ty, ty], both(G::ModfStruct, ty, false), modf),
        row(name("Modf"), &[ty], &[ty, ty], both(G::Modf, ty, true), modf),
        row(name("Modf into an array"), &[ty, Ty::scalar(Kind::U32)], &[ty, ty], through_array, modf)
            .of(1, Domain::Integers(0, 3)),
        each(Glsl(G::Ldexp), &[ty, exponents], ty, move |v| {
            let (x, exponent) = (kind.float(v[0]), Kind::I32.integer(v[1]));
            ldexp(kind, x, exponent, largest)
        })
        .of(1, Domain::Integers(-largest - 30, largest + 2)),
    ]
}

fn frexp(kind: Kind, bits: u64) -> (Expect, Expect) {
    let x = kind.float(bits);
    if x == 0.0 || !x.is_finite() {
        let zero = x == 0.0;
        let exponent = if zero { Expect::Is(0) } else { Expect::Any };
        let same = if zero { correct_but_sign_of_zero(kind, 0.0) } else { Expect::Any };
        return (same, exponent);
    }
    // Denormal doubles are normalized first.
    let tiny = x.abs() < f64::MIN_POSITIVE;
    let normal = if tiny { x * 2f64.powi(64) } else { x };
    let exponent = (normal.to_bits() >> 52 & 0x7ff) as i32 - 1022;
    let significand = normal / 2f64.powi(exponent - 1) / 2.0;
    let exponent = exponent - if tiny { 64 } else { 0 };
    (correct(kind, significand), Expect::Is(Kind::I32.wrap(i128::from(exponent))))
}

fn ldexp(kind: Kind, x: f64, exponent: i128, largest: i128) -> Expect {
    if exponent > largest || !x.is_finite() {
        return Expect::Any;
    }
    // In two steps, since a single power of two could overflow or underflow.
    let exponent = i32::try_from(exponent).expect("bounded above");
    let half = exponent / 2;
    let value = x * 2f64.powi(half) * 2f64.powi(exponent - half);
    let exact = kind.round(value);
    let denormal = value.abs() < kind.least_normal();
    // Below this exponent, and for denormal results, zero is allowed.
    if i128::from(exponent) < 2 - largest || kind == Kind::F64 && denormal {
        return Expect::OneOf(vec![exact, kind.round(0.0), kind.round(-0.0)]);
    }
    Expect::Is(exact)
}

type Formula = fn(Format, f64) -> Maybe;

fn half_of(p: Format, x: Maybe) -> Maybe {
    p.mul(x?, exactly(0.5))
}

fn hyperbolic(p: Format, x: f64, sum: bool) -> Maybe {
    let (up, down) = (p.exp(exactly(x))?, p.exp(exactly(-x))?);
    half_of(p, if sum { p.add(up, down) } else { p.sub(up, down) })
}

fn sine_of_cosine(p: Format, x: f64) -> Maybe {
    p.sqrt(p.sub(exactly(1.0), p.mul(exactly(x), exactly(x))?)?)
}

fn inverse_hyperbolic(p: Format, x: f64, one: f64) -> Maybe {
    let square = p.add(p.mul(exactly(x), exactly(x))?, exactly(one))?;
    p.log(p.add(exactly(x), p.sqrt(square)?)?)
}

type Function = fn(f64) -> f64;

/// The function, the formula that defines its precision, and the usual size of its operand.
const FUNCTIONS: &[(G, Function, Formula, f64)] = &[
    (G::Sin, f64::sin, |p, x| p.sin(x), PI),
    (G::Cos, f64::cos, |p, x| p.cos(x), PI),
    (G::Tan, f64::tan, |p, x| p.div(p.sin(x)?, p.cos(x)?), PI),
    (G::Asin, f64::asin, |p, x| p.atan2(exactly(x), sine_of_cosine(p, x)?), 1.0),
    (G::Acos, f64::acos, |p, x| p.atan2(sine_of_cosine(p, x)?, exactly(x)), 1.0),
    (G::Atan, f64::atan, |p, x| p.atan2(exactly(x), exactly(1.0)), 1e4),
    (G::Sinh, f64::sinh, |p, x| hyperbolic(p, x, false), 10.0),
    (G::Cosh, f64::cosh, |p, x| hyperbolic(p, x, true), 10.0),
    (G::Tanh, f64::tanh, |p, x| p.div(hyperbolic(p, x, false)?, hyperbolic(p, x, true)?), 10.0),
    (G::Asinh, f64::asinh, |p, x| inverse_hyperbolic(p, x, 1.0), 50.0),
    (G::Acosh, f64::acosh, |p, x| inverse_hyperbolic(p, x, -1.0), 50.0),
    (
        G::Atanh,
        f64::atanh,
        |p, x| {
            let (up, down) = (p.add(exactly(1.0), exactly(x))?, p.sub(exactly(1.0), exactly(x))?);
            half_of(p, p.log(p.rounded(p.div(up, down)?)))
        },
        1.0,
    ),
    (G::Exp, f64::exp, |p, x| p.exp(exactly(x)), 20.0),
    (G::Exp2, f64::exp2, |p, x| p.exp2(exactly(x)), 20.0),
    (G::Log, f64::ln, |p, x| p.log(exactly(x)), 2.0),
    (G::Log2, f64::log2, |p, x| p.log2(exactly(x)), 2.0),
];

fn transcendental(kind: Kind) -> Vec<Row> {
    let (ty, p) = (Ty::scalar(kind), format(kind));
    let mut rows = Vec::new();
    for (op, function, formula, most) in FUNCTIONS {
        let model = move |v: &[u64]| {
            let x = kind.float(v[0]);
            match x.is_finite() {
                true => p.inherited(function(x), formula(p, x)).into(),
                false => Expect::Any,
            }
        };
        rows.push(each(Glsl(*op), &[ty], ty, model));
        let mut usual = each(Glsl(*op), &[ty], ty, model).of(0, Domain::Floats(-most, *most));
        usual.name += " in its usual range";
        rows.push(usual);
    }
    let power = move |v: &[u64]| {
        let (x, y) = (kind.float(v[0]), kind.float(v[1]));
        match x {
            0.0 if y > 0.0 && y.is_finite() => correct(kind, 0.0),
            x if x > 0.0 && x.is_finite() && y.is_finite() => {
                let formula = || {
                    let logarithm = p.rounded(p.log2(exactly(x))?);
                    p.exp2(p.mul(exactly(y), logarithm)?)
                };
                p.inherited(x.powf(y), formula()).into()
            }
            _ => Expect::Any,
        }
    };
    let angle = move |v: &[u64]| {
        let (y, x) = (kind.float(v[0]), kind.float(v[1]));
        p.inherited(y.atan2(x), p.atan2(exactly(y), exactly(x))).into()
    };
    let two = [ty, ty];
    let around = Domain::Floats(-10.0, 10.0);
    for (op, usual, model) in [
        (G::Pow, Domain::Floats(0.0, 10.0), Box::new(power) as Box<dyn Fn(&[u64]) -> Expect>),
        (G::Atan2, around, Box::new(angle)),
    ] {
        let model = std::rc::Rc::new(model);
        let again = model.clone();
        rows.push(each(Glsl(op), &two, ty, move |v| model(v)));
        let mut row = each(Glsl(op), &two, ty, move |v| again(v)).of(0, usual).of(1, around);
        row.name += " in its usual range";
        rows.push(row);
    }
    rows
}

/// A number scaled to an integer: the possible results after rounding the product and then rounding to an integer, in
/// either direction at a half.
fn scaled(value: f64, least: f64, most: f64) -> Option<Vec<i128>> {
    let product = format(Kind::F32).rounded(exactly(value.clamp(least, 1.0) * most));
    let whole = [product.low, product.high].map(|value| [value.round_ties_even() as i128, value.round() as i128]);
    let mut all = whole.concat();
    all.dedup();
    (!value.is_nan()).then_some(all)
}

fn packing() -> Vec<Row> {
    let word = Ty::scalar(Kind::U32);
    let mut rows = Vec::new();
    let normalized = [
        (G::PackSnorm4x8, G::UnpackSnorm4x8, 4u32, Kind::I8, -1.0),
        (G::PackUnorm4x8, G::UnpackUnorm4x8, 4, Kind::U8, 0.0),
        (G::PackSnorm2x16, G::UnpackSnorm2x16, 2, Kind::I16, -1.0),
        (G::PackUnorm2x16, G::UnpackUnorm2x16, 2, Kind::U16, 0.0),
    ];
    for (pack, unpack, count, part, least) in normalized {
        let vector = Ty::vector(Kind::F32, count);
        let bits = part.bits();
        let most = (part.mask() >> u32::from(part.is_signed())) as f64;
        let model = move |v: &[Vec<u64>]| {
            let mut all = vec![0];
            for (index, bits_of_float) in (0..).zip(&v[0]) {
                let Some(either) = scaled(Kind::F32.float(*bits_of_float), least, most) else {
                    return vec![Expect::Any];
                };
                let place = |value: i128| part.wrap(value) << (bits * index);
                all = all.iter().flat_map(|word| either.iter().map(move |value| word | place(*value))).collect();
                all.dedup();
            }
            vec![Expect::OneOf(all)]
        };
        rows.push(whole(Glsl(pack), &[vector], word, model));
        let mut usual = whole(Glsl(pack), &[vector], word, model).of(0, Domain::Floats(-1.25, 1.25));
        usual.name += " in its usual range";
        rows.push(usual);
        rows.push(whole(Glsl(unpack), &[word], vector, move |v| {
            (0..count)
                .map(|index| {
                    let value = part.integer(v[0][0] >> (bits * index)) as f64 / most;
                    // The precision of a division: 2.5 units in the last place.
                    let p = format(Kind::F32);
                    let value = exactly(value.max(-1.0));
                    let error = 2.5 * p.ulp(value.low);
                    Expect::Within(Interval { low: value.low - error, high: value.high + error })
                })
                .collect()
        }));
    }
    let halves = Ty::vector(Kind::F32, 2);
    let mut half = whole(Glsl(G::PackHalf2x16), &[halves], word, |v| {
        let part = |k: usize| Kind::F16.round(Kind::F32.float(v[0][k]));
        let number = |k: usize| Kind::F32.float(v[0][k]).is_nan();
        match number(0) || number(1) {
            true => vec![Expect::Any],
            false => vec![Expect::Is(part(0) | part(1) << 16)],
        }
    });
    half.flushes = true;
    rows.push(half);
    rows.push(whole(Glsl(G::UnpackHalf2x16), &[word], halves, |v| {
        [0, 16].map(|at| correct(Kind::F32, Kind::F16.float(v[0][0] >> at & 0xffff))).to_vec()
    }));
    let (double, pair) = (Ty::scalar(Kind::F64), Ty::vector(Kind::U32, 2));
    let mut joined = whole(Glsl(G::PackDouble2x32), &[pair], double, |v| vec![Expect::Is(v[0][0] | v[0][1] << 32)]);
    joined.flushes = false;
    let mut parted = whole(Glsl(G::UnpackDouble2x32), &[double], pair, |v| {
        vec![Expect::Is(v[0][0] & 0xffff_ffff), Expect::Is(v[0][0] >> 32)]
    });
    parted.flushes = false;
    rows.extend([joined, parted]);
    rows
}
