//! Gaussian stages.
