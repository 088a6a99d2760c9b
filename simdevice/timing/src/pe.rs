//! Operations of a processing element: what one pixel and primitive take, GauRast, Table II. The scalar PE of the studies
//! computes pixels with its units as methods, and its tests hold its counts against these.

use serde::Serialize;

/// How often each unit was used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Operations {
    /// Additions and subtractions.
    pub add: u64,
    /// Multiplications.
    pub mul: u64,
    /// Divisions.
    pub div: u64,
    /// Exponentials.
    pub exp: u64,
}

impl Operations {
    /// What a PE does for one pixel and triangle; GauRast, Table II.
    pub const TRIANGLE: Self = Self {
        add: 9,
        mul: 9,
        div: 1,
        exp: 0,
    };
    /// What a PE does for one pixel and Gaussian; GauRast, Table II: 2 adders, 1 multiplier and the exponential more.
    pub const GAUSSIAN: Self = Self {
        add: 11,
        mul: 10,
        div: 0,
        exp: 1,
    };
    /// Of a Gaussian's, those that only a Gaussian that is blended needs: 3 colours, and the next transmittance with
    /// its test. Their inputs are gated otherwise.
    pub const BLEND: Self = Self {
        add: 3,
        mul: 3,
        div: 0,
        exp: 0,
    };
}
