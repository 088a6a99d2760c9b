//! Products of vectors and matrices, determinants and inverses.

use isa::ir::Reg;
use isa::op::Op as Ir;
use spirv::{Decoration, Op};

use super::super::error::{Result, malformed};
use super::super::instruction::Instruction;
use super::super::types::Scalar;
use super::Translator;
use super::arithmetic::op_for_width;
use super::composite::Matrix;

impl Translator<'_> {
    /// `OpDot` and products with matrices.
    pub fn linear_algebra(&mut self, it: &Instruction) -> Result<()> {
        let contract = !self.module.has(it.result()?, Decoration::NoContraction);
        let (first, second) = (it.id(0)?, it.id(1)?);
        let regs = match it.opcode {
            Op::Dot => {
                let (scalar, a) = self.vector(first)?;
                let b = self.regs(second)?;
                vec![self.dot(scalar, &a, &b, contract)?]
            }
            Op::VectorTimesScalar | Op::MatrixTimesScalar => {
                let (a, b) = (self.regs(first)?, self.reg(second)?);
                let scalar = self.result_scalar(it)?;
                let mut regs = Vec::with_capacity(a.len());
                for a in a.iter() {
                    let product = self.mul(scalar, *a, b);
                    if contract && scalar != (Scalar::Float { width: 16 }) {
                        self.products.insert(product, (*a, b));
                    }
                    regs.push(product);
                }
                regs
            }
            Op::MatrixTimesVector => {
                let (matrix, vector) = (self.matrix(first)?, self.regs(second)?);
                let scalar = self.result_scalar(it)?;
                (0..matrix.rows)
                    .map(|row| self.dot(scalar, &matrix.row(row), &vector, contract))
                    .collect::<Result<_>>()?
            }
            Op::VectorTimesMatrix => {
                let (vector, matrix) = (self.regs(first)?, self.matrix(second)?);
                let scalar = self.result_scalar(it)?;
                (0..matrix.columns)
                    .map(|column| self.dot(scalar, &vector, matrix.column(column), contract))
                    .collect::<Result<_>>()?
            }
            Op::MatrixTimesMatrix => {
                let (a, b) = (self.matrix(first)?, self.matrix(second)?);
                let scalar = self.result_scalar(it)?;
                let mut regs = Vec::with_capacity(a.rows * b.columns);
                for column in 0..b.columns {
                    for row in 0..a.rows {
                        regs.push(self.dot(scalar, &a.row(row), b.column(column), contract)?);
                    }
                }
                regs
            }
            _ => {
                let (a, b) = (self.regs(first)?, self.regs(second)?);
                let scalar = self.result_scalar(it)?;
                let mut regs = Vec::with_capacity(a.len() * b.len());
                self.charge_budget(a.len() * b.len())?;
                for b in b.iter() {
                    regs.extend(a.iter().map(|a| self.mul(scalar, *a, *b)));
                }
                regs
            }
        };
        self.define(it, regs)
    }

    /// The scalar of a result that is a scalar, vector or matrix.
    fn result_scalar(&self, it: &Instruction) -> Result<Scalar> {
        let ty = it.ty()?;
        match self.globals.types.matrix(ty) {
            Ok((_, _, _, scalar)) => Ok(scalar),
            Err(_) => Ok(self.globals.types.vector(ty)?.0),
        }
    }

    /// `a * b` on floats.
    pub fn mul(&mut self, scalar: Scalar, a: Reg, b: Reg) -> Reg {
        let reg = self.op(op_for_width(scalar, Ir::FMul, Ir::FMul64), &[a, b]);
        self.wrap_to_width(scalar, reg)
    }

    /// `a + b` on floats.
    pub fn plus(&mut self, scalar: Scalar, a: Reg, b: Reg) -> Reg {
        let reg = self.op(op_for_width(scalar, Ir::FAdd, Ir::FAdd64), &[a, b]);
        self.wrap_to_width(scalar, reg)
    }

    /// `a - b` on floats.
    pub fn minus(&mut self, scalar: Scalar, a: Reg, b: Reg) -> Reg {
        let reg = self.op(op_for_width(scalar, Ir::FSub, Ir::FSub64), &[a, b]);
        self.wrap_to_width(scalar, reg)
    }

    /// `a / b` on floats.
    pub fn over(&mut self, scalar: Scalar, a: Reg, b: Reg) -> Reg {
        let reg = self.op(op_for_width(scalar, Ir::FDiv, Ir::FDiv64), &[a, b]);
        self.wrap_to_width(scalar, reg)
    }

    /// The sum of products; halves are rounded once, at the end.
    pub fn dot(&mut self, scalar: Scalar, a: &[Reg], b: &[Reg], contract: bool) -> Result<Reg> {
        if a.len() != b.len() || a.is_empty() {
            return malformed("the operands differ in size");
        }
        let mut sum = self.op(op_for_width(scalar, Ir::FMul, Ir::FMul64), &[a[0], b[0]]);
        for (a, b) in a.iter().zip(b).skip(1) {
            sum = if contract {
                self.op(op_for_width(scalar, Ir::FFma, Ir::FFma64), &[*a, *b, sum])
            } else {
                let product = self.op(op_for_width(scalar, Ir::FMul, Ir::FMul64), &[*a, *b]);
                self.op(op_for_width(scalar, Ir::FAdd, Ir::FAdd64), &[sum, product])
            };
        }
        Ok(self.wrap_to_width(scalar, sum))
    }

    /// `a * b - c * d`.
    fn cross_product(&mut self, scalar: Scalar, [a, b, c, d]: [Reg; 4]) -> Reg {
        let (left, right) = (self.mul(scalar, a, b), self.mul(scalar, c, d));
        self.minus(scalar, left, right)
    }

    /// The determinant of the rows and columns that are left of a square matrix.
    fn minor(
        &mut self,
        scalar: Scalar,
        matrix: &Matrix,
        rows: &[usize],
        columns: &[usize],
    ) -> Result<Reg> {
        match (rows, columns) {
            ([row], [column]) => Ok(matrix.at(*row, *column)),
            ([r0, r1], [c0, c1]) => {
                let at = |row: &usize, column: &usize| matrix.at(*row, *column);
                Ok(self.cross_product(scalar, [at(r0, c0), at(r1, c1), at(r0, c1), at(r1, c0)]))
            }
            ([first, rest @ ..], _) if rows.len() == columns.len() => {
                let mut sum = None;
                for (index, column) in columns.iter().enumerate() {
                    let others: Vec<usize> = columns
                        .iter()
                        .copied()
                        .filter(|other| other != column)
                        .collect();
                    let minor = self.minor(scalar, matrix, rest, &others)?;
                    let term = self.mul(scalar, matrix.at(*first, *column), minor);
                    sum = Some(match sum {
                        None => term,
                        Some(sum) if index % 2 == 1 => self.minus(scalar, sum, term),
                        Some(sum) => self.plus(scalar, sum, term),
                    });
                }
                sum.map_or_else(|| malformed("the matrix has no columns"), Ok)
            }
            _ => malformed("the matrix isn't square"),
        }
    }

    /// The determinant of a square matrix.
    pub fn determinant(&mut self, scalar: Scalar, matrix: &Matrix) -> Result<Reg> {
        let all: Vec<usize> = (0..matrix.rows).collect();
        let columns: Vec<usize> = (0..matrix.columns).collect();
        self.minor(scalar, matrix, &all, &columns)
    }

    /// The inverse of a square matrix: its adjugate divided by its determinant.
    pub fn inverse(&mut self, scalar: Scalar, matrix: &Matrix) -> Result<Vec<Reg>> {
        let size = matrix.rows;
        if size != matrix.columns {
            return malformed("the matrix isn't square");
        }
        let all = |without: usize| -> Vec<usize> {
            (0..size).filter(|index| *index != without).collect()
        };
        let mut adjugate = Vec::with_capacity(size * size);
        for column in 0..size {
            for row in 0..size {
                // Element (row, column) of the adjugate is the cofactor (column, row).
                let minor = self.minor(scalar, matrix, &all(column), &all(row))?;
                let odd = (row + column) % 2 == 1;
                adjugate.push(if odd {
                    self.op(op_for_width(scalar, Ir::FNeg, Ir::FNeg64), &[minor])
                } else {
                    minor
                });
            }
        }
        let first_row: Vec<Reg> = (0..size).map(|column| matrix.at(0, column)).collect();
        let determinant = self.dot(scalar, &first_row, &adjugate[..size], false)?;
        Ok(adjugate
            .into_iter()
            .map(|cofactor| self.over(scalar, cofactor, determinant))
            .collect())
    }
}
