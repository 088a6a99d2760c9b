//! Activation functions of trained files: from stored logarithms and logits to attributes. Each function is evaluated
//! in binary64 and rounded once to binary32.

/// The standard deviation of a logarithm.
pub fn scale_of_logarithm(logarithm: f32) -> f32 {
    f64::from(logarithm).exp() as f32
}

/// The opacity of a logit.
pub fn opacity_of_logit(logit: f32) -> f32 {
    (1.0 / (1.0 + (-f64::from(logit)).exp())) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values to 17 digits, from tables.
    #[test]
    fn known_values() {
        for (x, expected) in [
            (0.0, 1.0),
            (1.0, std::f64::consts::E),
            (-1.0, 0.367_879_441_171_442_33),
            (0.5, 1.648_721_270_700_128_2),
            (-4.5, 0.011_108_996_538_242_306),
        ] {
            assert_eq!(scale_of_logarithm(x), expected as f32);
        }
        for (x, expected) in [
            (0.0, 0.5),
            (1.0, 0.731_058_578_630_004_9),
            (-1.0, 0.268_941_421_369_995_1),
            (2.0, 0.880_797_077_977_882_3),
            (-4.0, 0.017_986_209_962_091_56),
        ] {
            assert_eq!(opacity_of_logit(x), expected as f32);
        }
        assert_eq!(scale_of_logarithm(f32::NEG_INFINITY), 0.0);
        assert_eq!(opacity_of_logit(f32::NEG_INFINITY), 0.0);
        assert_eq!(opacity_of_logit(f32::INFINITY), 1.0);
        assert_eq!(scale_of_logarithm(200.0), f32::INFINITY);
    }
}
