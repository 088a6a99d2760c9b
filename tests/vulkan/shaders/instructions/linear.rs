//! Vectors and matrices.

use super::rows::What::{Core, Glsl};
use super::rows::{What, whole};
use gaurast_tests::programs::inputs::Domain;
use gaurast_tests::programs::precision::{Format, Interval, Maybe, exactly, format};
use gaurast_tests::programs::types::{Kind, Ty};
use gaurast_tests::programs::{Expect, Row};
use spirv::{GlslStd450Op as G, Op};

fn numbers(kind: Kind, bits: &[u64]) -> Vec<f64> {
    bits.iter().map(|bits| kind.float(*bits)).collect()
}

fn exact(values: &[f64]) -> Vec<Interval> {
    values.iter().copied().map(exactly).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The sum of the products, with the error that the formula allows.
fn product(p: Format, a: &[f64], b: &[f64]) -> Expect {
    p.inherited(dot(a, b), p.dot(&exact(a), &exact(b))).into()
}

/// The correctly rounded product of two components.
fn times(kind: Kind, a: f64, b: f64) -> Expect {
    Expect::Is(kind.round(a * b))
}

pub fn rows() -> Vec<Row> {
    Kind::FLOATS
        .into_iter()
        .flat_map(|kind| {
            let mut rows = products(kind);
            rows.extend(geometry(kind));
            if kind != Kind::F16 {
                rows.extend((2..5).flat_map(|size| of_square_matrices(kind, size)));
            }
            rows
        })
        .collect()
}

fn products(kind: Kind) -> Vec<Row> {
    let p = format(kind);
    let (one, vector) = (Ty::scalar(kind), Ty::vector(kind, 3));
    let (tall, wide) = (Ty::matrix(kind, 2, 3), Ty::matrix(kind, 4, 2));
    // Column c of the product is the first matrix applied to column c of the second.
    let rows_of = |matrix: &[f64], rows: usize| -> Vec<Vec<f64>> {
        (0..rows).map(|row| matrix.iter().skip(row).step_by(rows).copied().collect()).collect()
    };
    let mut all: Vec<Row> = (2..5)
        .map(|size| {
            let ty = Ty::vector(kind, size);
            whole(Core(Op::Dot), &[ty, ty], one, move |v| {
                vec![product(p, &numbers(kind, &v[0]), &numbers(kind, &v[1]))]
            })
        })
        .collect();
    let scaled = move |v: &[Vec<u64>]| {
        let factor = kind.float(v[1][0]);
        numbers(kind, &v[0]).into_iter().map(|value| times(kind, value, factor)).collect()
    };
    all.extend([
        whole(Core(Op::VectorTimesScalar), &[vector, one], vector, scaled),
        whole(Core(Op::MatrixTimesScalar), &[tall, one], tall, scaled),
        whole(Core(Op::OuterProduct), &[vector, Ty::vector(kind, 2)], tall, move |v| {
            let (a, b) = (numbers(kind, &v[0]), numbers(kind, &v[1]));
            b.iter().flat_map(|b| a.iter().map(move |a| times(kind, *a, *b))).collect()
        }),
        whole(Core(Op::MatrixTimesVector), &[tall, Ty::vector(kind, 2)], vector, move |v| {
            let (matrix, vector) = (numbers(kind, &v[0]), numbers(kind, &v[1]));
            rows_of(&matrix, 3).iter().map(|row| product(p, row, &vector)).collect()
        }),
        whole(Core(Op::VectorTimesMatrix), &[vector, tall], Ty::vector(kind, 2), move |v| {
            let (vector, matrix) = (numbers(kind, &v[0]), numbers(kind, &v[1]));
            matrix.chunks(3).map(|column| product(p, &vector, column)).collect()
        }),
        whole(Core(Op::MatrixTimesMatrix), &[tall, wide], Ty::matrix(kind, 4, 3), move |v| {
            let (left, right) = (numbers(kind, &v[0]), numbers(kind, &v[1]));
            let rows = rows_of(&left, 3);
            right.chunks(2).flat_map(|column| rows.iter().map(move |row| product(p, row, column))).collect()
        }),
    ]);
    all
}

fn length(p: Format, v: &[Interval]) -> Maybe {
    p.sqrt(p.dot(v, v)?)
}

fn difference(p: Format, a: &[f64], b: &[f64]) -> Option<Vec<Interval>> {
    a.iter().zip(b).map(|(a, b)| p.sub(exactly(*a), exactly(*b))).collect()
}

fn geometry(kind: Kind) -> Vec<Row> {
    let p = format(kind);
    let (one, vector) = (Ty::scalar(kind), Ty::vector(kind, 3));
    let norm = |v: &[f64]| match v {
        [one] => one.abs(),
        _ => dot(v, v).sqrt(),
    };
    let both = move |v: &[Vec<u64>]| (numbers(kind, &v[0]), numbers(kind, &v[1]));
    let mut rows: Vec<Row> = (1..5)
        .map(|size| {
            whole(Glsl(G::Length), &[Ty::vector(kind, size)], one, move |v| {
                let v = numbers(kind, &v[0]);
                vec![p.inherited(norm(&v), length(p, &exact(&v))).into()]
            })
        })
        .collect();
    let pair = [vector, vector];
    rows.extend([
        whole(Glsl(G::Distance), &pair, one, move |v| {
            let (a, b) = both(v);
            let apart: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
            let formula = difference(p, &a, &b).and_then(|apart| length(p, &apart));
            vec![p.inherited(norm(&apart), formula).into()]
        }),
        whole(Glsl(G::Cross), &pair, vector, move |v| {
            let (a, b) = both(v);
            [[1, 2], [2, 0], [0, 1]]
                .map(|[i, j]| {
                    let formula = || {
                        let left = p.mul(exactly(a[i]), exactly(b[j]))?;
                        p.sub(left, p.mul(exactly(b[i]), exactly(a[j]))?)
                    };
                    p.inherited(a[i] * b[j] - b[i] * a[j], formula()).into()
                })
                .to_vec()
        }),
        whole(Glsl(G::Normalize), &[vector], vector, move |v| {
            let v = numbers(kind, &v[0]);
            let inverse = || p.inverse_sqrt(p.dot(&exact(&v), &exact(&v))?);
            v.iter()
                .map(|x| {
                    let formula = inverse().and_then(|inverse| p.mul(exactly(*x), inverse));
                    p.inherited(x / norm(&v), formula).into()
                })
                .collect()
        }),
        whole(Glsl(G::FaceForward), &[vector, vector, vector], vector, move |v| {
            let (i, reference) = (numbers(kind, &v[1]), numbers(kind, &v[2]));
            let along = p.dot(&exact(&reference), &exact(&i));
            let facing = |along: Interval| match along {
                along if along.high < 0.0 => Some(false),
                along if along.low >= 0.0 => Some(true),
                _ => None,
            };
            let turned = along.and_then(facing);
            v[0].iter()
                .map(|bits| {
                    let away = kind.round(-kind.float(*bits));
                    match turned {
                        Some(true) => Expect::Is(away),
                        Some(false) => Expect::Is(*bits),
                        None if kind.float(*bits).is_nan() => Expect::Any,
                        None => Expect::OneOf(vec![*bits, away]),
                    }
                })
                .collect()
        }),
        whole(Glsl(G::Reflect), &pair, vector, move |v| {
            let (i, n) = both(v);
            let along = p.dot(&exact(&n), &exact(&i));
            (0..3)
                .map(|k| {
                    let formula = || {
                        let twice = p.mul(exactly(2.0), along?)?;
                        p.sub(exactly(i[k]), p.mul(twice, exactly(n[k]))?)
                    };
                    let truth = i[k] - 2.0 * dot(&n, &i) * n[k];
                    p.inherited(truth, formula()).into()
                })
                .collect()
        }),
        whole(Glsl(G::Refract), &[vector, vector, one], vector, move |v| {
            let (i, n) = both(v);
            refraction(p, &i, &n, kind.float(v[2][0]))
        })
        .of(0, Domain::Floats(-1.0, 1.0))
        .of(1, Domain::Floats(-1.0, 1.0))
        .of(2, Domain::Floats(0.25, 2.0)),
    ]);
    rows
}

fn refraction(p: Format, i: &[f64], n: &[f64], eta: f64) -> Vec<Expect> {
    let along = dot(n, i);
    let k = 1.0 - eta * eta * (1.0 - along * along);
    let (one, eta_exactly) = (exactly(1.0), exactly(eta));
    let discriminant = || {
        let along = p.dot(&exact(n), &exact(i))?;
        let rest = p.sub(one, p.mul(along, along)?)?;
        let square = p.mul(eta_exactly, eta_exactly)?;
        Some((along, p.sub(one, p.mul(square, rest)?)?))
    };
    let formula = |component: usize| -> Maybe {
        let (along, k) = discriminant()?;
        if k.high < 0.0 {
            return Some(exactly(0.0));
        }
        // If the sign of k is not certain, any result is allowed.
        (k.low >= 0.0).then_some(())?;
        let factor = p.add(p.mul(eta_exactly, along)?, p.sqrt(k)?)?;
        let bent = p.mul(eta_exactly, exactly(i[component]))?;
        p.sub(bent, p.mul(factor, exactly(n[component]))?)
    };
    (0..3)
        .map(|component| {
            let truth = match k < 0.0 {
                true => 0.0,
                false => eta * i[component] - (eta * along + k.sqrt()) * n[component],
            };
            p.inherited(truth, formula(component)).into()
        })
        .collect()
}

/// The determinant by expansion along the first row; `m` is stored by columns.
fn determinant(m: &[f64], size: usize) -> f64 {
    if size == 1 {
        return m[0];
    }
    (0..size)
        .map(|column| {
            let sign = if column % 2 == 0 { 1.0 } else { -1.0 };
            sign * m[column * size] * determinant(&without(m, size, column, 0), size - 1)
        })
        .sum()
}

fn without(m: &[f64], size: usize, column: usize, row: usize) -> Vec<f64> {
    (0..size * size).filter(|at| at / size != column && at % size != row).map(|at| m[at]).collect()
}

/// Determinants and inverses. The specification requires no precision for them. The tests require 64 units in the last
/// place of the largest intermediate number, for matrices of small numbers that are far from singular.
fn of_square_matrices(kind: Kind, size: u32) -> Vec<Row> {
    let p = format(kind);
    let matrix = Ty::matrix(kind, size, size);
    let n = size as usize;
    let near = move |value: f64, largest: f64| {
        let error = 64.0 * p.ulp(largest);
        Expect::Within(Interval { low: value - error, high: value + error })
    };
    let small = Domain::Floats(-2.0, 2.0);
    let one: What = Glsl(G::Determinant);
    vec![
        whole(one, &[matrix], Ty::scalar(kind), move |v| vec![near(determinant(&numbers(kind, &v[0]), n), 32.0)])
            .of(0, small),
        whole(Glsl(G::MatrixInverse), &[matrix], matrix, move |v| {
            let m = numbers(kind, &v[0]);
            let whole = determinant(&m, n);
            (0..n * n)
                .map(|at| {
                    let (column, row) = (at / n, at % n);
                    let minor = determinant(&without(&m, n, row, column), n - 1);
                    let sign = if (column + row) % 2 == 0 { 1.0 } else { -1.0 };
                    match whole.abs() < 0.25 {
                        true => Expect::Any,
                        false => near(sign * minor / whole, 32.0 / whole.abs().min(1.0).powi(2)),
                    }
                })
                .collect()
        })
        .of(0, small),
    ]
}
