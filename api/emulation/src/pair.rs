//! Numbers as sums of two binary32, as `shaders/pair.glsl` has them: what the kernels must compute.

/// A number: the sum rounded, and the rest.
pub(crate) type Pair = [f32; 2];

/// The pair nearest to a number.
pub(crate) fn pair(value: f64) -> Pair {
    let sum = value as f32;
    [sum, (value - f64::from(sum)) as f32]
}

pub(crate) fn two_sum(a: f32, b: f32) -> Pair {
    let s = a + b;
    let t = s - a;
    [s, (a - (s - t)) + (b - t)]
}

fn quick_two_sum(a: f32, b: f32) -> Pair {
    let s = a + b;
    [s, b - (s - a)]
}

fn split(a: f32) -> Pair {
    let t = 4097.0 * a;
    let high = t - (t - a);
    [high, a - high]
}

pub(crate) fn two_product(a: f32, b: f32) -> Pair {
    let p = a * b;
    let (x, y) = (split(a), split(b));
    [p, ((x[0] * y[0] - p) + x[0] * y[1] + x[1] * y[0]) + x[1] * y[1]]
}

pub(crate) fn add(a: Pair, b: Pair) -> Pair {
    let (s, t) = (two_sum(a[0], b[0]), two_sum(a[1], b[1]));
    let s = quick_two_sum(s[0], s[1] + t[0]);
    quick_two_sum(s[0], s[1] + t[1])
}

pub(crate) fn mul(a: Pair, b: Pair) -> Pair {
    let p = two_product(a[0], b[0]);
    quick_two_sum(p[0], p[1] + (a[0] * b[1] + a[1] * b[0]))
}
