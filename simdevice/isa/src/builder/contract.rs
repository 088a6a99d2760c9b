//! Contraction: a product and a sum become one fused operation.

use super::Builder;
use crate::ir::{Reg, Role};
use crate::op::Op;

/// A product that may be fused into a sum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Product {
    factors: [Reg; 2],
    /// The straight run of statements that it is in.
    segment: u32,
}

impl Builder {
    /// Like [`Builder::compute`], where fusing is allowed (not under SPIR-V's `NoContraction`): `FAdd` and `FSub` of a
    /// product that was itself computed by this method become `FFma`, `FMulSub` or `FNegMulAdd`. The product goes if
    /// nothing else uses it.
    pub fn compute_contracted(&mut self, op: Op, src: &[Reg]) -> Reg {
        if let (Op::FAdd | Op::FSub, &[a, b]) = (op, src) {
            if let Some([x, y]) = self.factors(a) {
                let fused = if op == Op::FAdd {
                    Op::FFma
                } else {
                    Op::FMulSub
                };
                return self.compute(fused, &[x, y, b]);
            }
            if let Some([x, y]) = self.factors(b) {
                let fused = if op == Op::FAdd {
                    Op::FFma
                } else {
                    Op::FNegMulAdd
                };
                return self.compute(fused, &[x, y, a]);
            }
        }
        let result = self.compute(op, src);
        if let (Op::FMul, &[x, y]) = (op, src) {
            self.products.insert(
                result,
                Product {
                    factors: [x, y],
                    segment: self.segment,
                },
            );
        }
        result
    }

    /// The factors of a product, if they still hold what they held.
    fn factors(&self, product: Reg) -> Option<[Reg; 2]> {
        let Product { factors, segment } = *self.products.get(&product)?;
        let is_value = |reg: &Reg| {
            self.program
                .registers
                .get(reg.0 as usize)
                .is_some_and(|register| register.role == Role::Value)
        };
        (segment == self.segment || factors.iter().all(is_value)).then_some(factors)
    }
}
