//! Contraction: a product and a sum become one fused operation.

use std::collections::HashMap;

use crate::ir::op::Op;
use crate::ir::{Reg, Register, Role};

/// The products of a program that sums may be fused with.
#[derive(Debug, Default)]
pub struct Products {
    by_register: HashMap<Reg, Product>,
    /// The number of the current run of statements without assignments.
    segment: u32,
}

/// A product that may be fused into a sum.
#[derive(Clone, Copy, Debug)]
struct Product {
    factors: [Reg; 2],
    /// The number of the run that it is in.
    segment: u32,
}

impl Products {
    /// Ends a run of statements: variables may have changed after it.
    pub fn end_segment(&mut self) {
        self.segment += 1;
    }

    /// Adds a product, by the register that holds it.
    pub fn insert(&mut self, product: Reg, factors: [Reg; 2]) {
        let segment = self.segment;
        self.by_register.insert(product, Product { factors, segment });
    }

    /// The operation and operands that fuse a sum or difference with a product among its operands. None if no operand
    /// is a product, or a factor may have changed since.
    pub fn fuse(&self, registers: &[Register], op: Op, src: &[Reg]) -> Option<(Op, [Reg; 3])> {
        let (of_left, of_right) = match op {
            Op::FAdd => (Op::FFma, Op::FFma),
            Op::FSub => (Op::FMulSub, Op::FNegMulAdd),
            _ => return None,
        };
        let &[a, b] = src else { return None };
        if let Some([x, y]) = self.factors(registers, a) {
            return Some((of_left, [x, y, b]));
        }
        let [x, y] = self.factors(registers, b)?;
        Some((of_right, [x, y, a]))
    }

    /// The factors of a product. None if a factor may have changed since.
    fn factors(&self, registers: &[Register], product: Reg) -> Option<[Reg; 2]> {
        let Product { factors, segment } = *self.by_register.get(&product)?;
        let is_value = |reg: &Reg| {
            let register = registers.get(reg.0 as usize);
            register.is_some_and(|register| register.role == Role::Value)
        };
        (segment == self.segment || factors.iter().all(is_value)).then_some(factors)
    }
}
