//! Operation counts of a processing element for one pixel and primitive, from GauRast's Table II. The scalar PE of
//! `timing-studies` computes pixels with its units as methods; its tests compare its counts with these.

use serde::Serialize;

/// The number of uses of each unit.
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

/// A number for a use of each unit, such as an area or an energy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PerUnit {
    /// Of an adder.
    pub(crate) add: f64,
    /// Of a multiplier.
    pub(crate) mul: f64,
    /// Of a divider.
    pub(crate) div: f64,
    /// Of an exponential unit.
    pub(crate) exp: f64,
}

impl PerUnit {
    /// The sum over uses of units.
    pub(crate) fn sum(&self, uses: Operations) -> f64 {
        uses.add as f64 * self.add
            + uses.mul as f64 * self.mul
            + uses.div as f64 * self.div
            + uses.exp as f64 * self.exp
    }
}

impl Operations {
    /// The operations of a PE for one pixel and triangle; GauRast, Table II.
    pub const TRIANGLE: Self = Self { add: 9, mul: 9, div: 1, exp: 0 };
    /// The operations of a PE for one pixel and Gaussian; GauRast, Table II: 2 additions, 1 multiplication and the
    /// exponential more than its triangle units have.
    pub const GAUSSIAN: Self = Self { add: 11, mul: 10, div: 0, exp: 1 };
    /// The share of [`Self::GAUSSIAN`] that only a blended Gaussian needs: 3 colours, and the next transmittance with
    /// its test. For other Gaussians the inputs of these units are gated.
    pub const BLEND: Self = Self { add: 3, mul: 3, div: 0, exp: 0 };
}
