//! Composites, extracted and constructed; products of vectors and matrices, determinants and inverses.

use std::rc::Rc;

use isa::ir::Reg;
use isa::op::Op as Ir;
use spirv::Op;

use super::emitter::op_for_width;
use super::translator::Translator;
use crate::error::{Result, malformed};
use crate::instruction::Instruction;
use crate::types::Scalar;

/// A matrix: its columns one after the other.
#[derive(Clone, Debug)]
pub struct Matrix {
    pub columns: usize,
    pub rows: usize,
    pub regs: Rc<[Reg]>,
}

impl Matrix {
    /// An element.
    pub fn at(&self, row: usize, column: usize) -> Reg {
        self.regs[column * self.rows + row]
    }

    /// A row.
    pub fn row(&self, row: usize) -> Vec<Reg> {
        (0..self.columns).map(|column| self.at(row, column)).collect()
    }

    /// A column.
    pub fn column(&self, column: usize) -> &[Reg] {
        &self.regs[column * self.rows..(column + 1) * self.rows]
    }

    /// Rows and columns exchanged.
    pub fn transposed(&self) -> Self {
        Self { columns: self.rows, rows: self.columns, regs: (0..self.rows).flat_map(|row| self.row(row)).collect() }
    }
}

/// Translates composite instructions.
pub fn composite(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    match instruction.opcode {
        Op::CompositeConstruct => {
            let limit = t.globals.types.scalars(instruction.ty()?)? as usize;
            t.emit.charge_budget(limit)?;
            let mut regs = Vec::with_capacity(limit);
            for part in instruction.ids(0) {
                regs.extend_from_slice(&t.regs(part)?);
                if regs.len() > limit {
                    return malformed("there are more parts than the type has");
                }
            }
            t.define(instruction, regs)
        }
        Op::CompositeConstructReplicateEXT => {
            let count = t.globals.types.scalars(instruction.ty()?)? as usize;
            t.emit.charge_budget(count)?;
            let part = t.regs(instruction.id(0)?)?;
            t.define(instruction, part.iter().copied().cycle().take(count).collect())
        }
        Op::CompositeExtract => {
            let whole = t.regs(instruction.id(0)?)?;
            let (start, count) = part(t, t.type_of(instruction.id(0)?)?, &instruction.numbers(1))?;
            t.emit.charge_budget(count)?;
            t.define(instruction, whole[start..start + count].to_vec())
        }
        Op::CompositeInsert => {
            let (object, whole) = (t.regs(instruction.id(0)?)?, t.regs(instruction.id(1)?)?);
            let (start, count) = part(t, t.type_of(instruction.id(1)?)?, &instruction.numbers(2))?;
            if object.len() != count {
                return malformed("the object doesn't fit its place");
            }
            t.emit.charge_budget(whole.len())?;
            let mut regs = whole.to_vec();
            regs[start..start + count].copy_from_slice(&object);
            t.define(instruction, regs)
        }
        Op::CopyLogical => {
            let regs = t.regs(instruction.id(0)?)?;
            t.emit.charge_budget(regs.len())?;
            t.define(instruction, regs.to_vec())
        }
        Op::VectorShuffle => {
            let (a, b) = (t.regs(instruction.id(0)?)?, t.regs(instruction.id(1)?)?);
            let mut regs = Vec::new();
            for index in instruction.numbers(2).into_iter().take(4) {
                let both = a.iter().chain(b.iter()).copied();
                let picked = both.clone().nth(index as usize);
                // All ones means an undefined component.
                match picked.or(both.clone().next().filter(|_| index == u32::MAX)) {
                    Some(reg) => regs.push(reg),
                    None => return malformed(format!("there is no component {index}")),
                }
            }
            t.define(instruction, regs)
        }
        Op::VectorExtractDynamic => {
            let (vector, index) = (t.regs(instruction.id(0)?)?, t.reg(instruction.id(1)?)?);
            let Some((first, rest)) = vector.split_first() else {
                return malformed("the operand has no components");
            };
            t.emit.charge_budget(2 * rest.len())?;
            let mut found = *first;
            for (element, reg) in (1..).zip(rest) {
                let element = t.emit.u32(element);
                let this = t.emit.op(Ir::IEq, &[index, element]);
                found = t.emit.select(this, *reg, found);
            }
            t.define(instruction, vec![found])
        }
        Op::VectorInsertDynamic => {
            let vector = t.regs(instruction.id(0)?)?;
            let (object, index) = (t.reg(instruction.id(1)?)?, t.reg(instruction.id(2)?)?);
            t.emit.charge_budget(2 * vector.len())?;
            let mut regs = Vec::with_capacity(vector.len());
            for (element, reg) in (0..).zip(vector.iter()) {
                let element = t.emit.u32(element);
                let this = t.emit.op(Ir::IEq, &[index, element]);
                regs.push(t.emit.select(this, object, *reg));
            }
            t.define(instruction, regs)
        }
        _ => {
            let matrix = matrix(t, instruction.id(0)?)?;
            let regs = matrix.transposed().regs;
            t.define(instruction, regs.to_vec())
        }
    }
}

/// The part at a path of indices: the number of scalars before it and in it.
fn part(t: &Translator, mut ty: u32, indices: &[u32]) -> Result<(usize, usize)> {
    let mut start = 0;
    for index in indices {
        let (part, before) = t.globals.types.part(ty, *index)?;
        ty = part;
        start += before as usize;
    }
    Ok((start, t.globals.types.scalars(ty)? as usize))
}

/// A matrix operand.
pub fn matrix(t: &mut Translator, id: u32) -> Result<Matrix> {
    let (columns, rows, _, _) = t.globals.types.matrix(t.type_of(id)?)?;
    Ok(Matrix { columns: columns as usize, rows: rows as usize, regs: t.regs(id)? })
}

/// Translates `OpDot` and products with matrices.
pub fn linear_algebra(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let contract = t.may_contract(instruction)?;
    let (first, second) = (instruction.id(0)?, instruction.id(1)?);
    let regs = match instruction.opcode {
        Op::Dot => {
            let (scalar, a) = t.vector(first)?;
            let b = t.regs(second)?;
            vec![dot(t, scalar, &a, &b, contract)?]
        }
        Op::VectorTimesScalar | Op::MatrixTimesScalar => {
            let (a, b) = (t.regs(first)?, t.reg(second)?);
            let scalar = result_scalar(t, instruction)?;
            let mut regs = Vec::with_capacity(a.len());
            for a in a.iter() {
                let product = t.emit.mul(scalar, *a, b);
                if contract && scalar != (Scalar::Float { width: 16 }) {
                    t.emit.set_product(product, [*a, b]);
                }
                regs.push(product);
            }
            regs
        }
        Op::MatrixTimesVector => {
            let (matrix, vector) = (matrix(t, first)?, t.regs(second)?);
            let scalar = result_scalar(t, instruction)?;
            (0..matrix.rows).map(|row| dot(t, scalar, &matrix.row(row), &vector, contract)).collect::<Result<_>>()?
        }
        Op::VectorTimesMatrix => {
            let (vector, matrix) = (t.regs(first)?, matrix(t, second)?);
            let scalar = result_scalar(t, instruction)?;
            (0..matrix.columns)
                .map(|column| dot(t, scalar, &vector, matrix.column(column), contract))
                .collect::<Result<_>>()?
        }
        Op::MatrixTimesMatrix => {
            let (a, b) = (matrix(t, first)?, matrix(t, second)?);
            let scalar = result_scalar(t, instruction)?;
            let mut regs = Vec::with_capacity(a.rows * b.columns);
            for column in 0..b.columns {
                for row in 0..a.rows {
                    regs.push(dot(t, scalar, &a.row(row), b.column(column), contract)?);
                }
            }
            regs
        }
        _ => {
            let (a, b) = (t.regs(first)?, t.regs(second)?);
            let scalar = result_scalar(t, instruction)?;
            let mut regs = Vec::with_capacity(a.len() * b.len());
            t.emit.charge_budget(a.len() * b.len())?;
            for b in b.iter() {
                regs.extend(a.iter().map(|a| t.emit.mul(scalar, *a, *b)));
            }
            regs
        }
    };
    t.define(instruction, regs)
}

/// The scalar of a result that is a scalar, vector or matrix.
fn result_scalar(t: &Translator, instruction: &Instruction) -> Result<Scalar> {
    let ty = instruction.ty()?;
    match t.globals.types.matrix(ty) {
        Ok((_, _, _, scalar)) => Ok(scalar),
        Err(_) => Ok(t.globals.types.vector(ty)?.0),
    }
}

/// The sum of products; halves are rounded once, at the end.
pub fn dot(t: &mut Translator, scalar: Scalar, a: &[Reg], b: &[Reg], contract: bool) -> Result<Reg> {
    if a.len() != b.len() || a.is_empty() {
        return malformed("the operands differ in size");
    }
    let mut sum = t.emit.op(op_for_width(scalar, Ir::FMul, Ir::FMul64), &[a[0], b[0]]);
    for (a, b) in a.iter().zip(b).skip(1) {
        sum = if contract {
            t.emit.op(op_for_width(scalar, Ir::FFma, Ir::FFma64), &[*a, *b, sum])
        } else {
            let product = t.emit.op(op_for_width(scalar, Ir::FMul, Ir::FMul64), &[*a, *b]);
            t.emit.op(op_for_width(scalar, Ir::FAdd, Ir::FAdd64), &[sum, product])
        };
    }
    Ok(t.emit.wrap_to_width(scalar, sum))
}

/// `a * b - c * d`.
fn cross_product(t: &mut Translator, scalar: Scalar, [a, b, c, d]: [Reg; 4]) -> Reg {
    let (left, right) = (t.emit.mul(scalar, a, b), t.emit.mul(scalar, c, d));
    t.emit.minus(scalar, left, right)
}

/// The determinant of the remaining rows and columns of a square matrix.
fn minor(t: &mut Translator, scalar: Scalar, matrix: &Matrix, rows: &[usize], columns: &[usize]) -> Result<Reg> {
    match (rows, columns) {
        ([row], [column]) => Ok(matrix.at(*row, *column)),
        ([r0, r1], [c0, c1]) => {
            let at = |row: &usize, column: &usize| matrix.at(*row, *column);
            Ok(cross_product(t, scalar, [at(r0, c0), at(r1, c1), at(r0, c1), at(r1, c0)]))
        }
        ([first, rest @ ..], _) if rows.len() == columns.len() => {
            let mut sum = None;
            for (index, column) in columns.iter().enumerate() {
                let others: Vec<usize> = columns.iter().copied().filter(|other| other != column).collect();
                let minor = minor(t, scalar, matrix, rest, &others)?;
                let term = t.emit.mul(scalar, matrix.at(*first, *column), minor);
                sum = Some(match sum {
                    None => term,
                    Some(sum) if index % 2 == 1 => t.emit.minus(scalar, sum, term),
                    Some(sum) => t.emit.plus(scalar, sum, term),
                });
            }
            sum.map_or_else(|| malformed("the matrix has no columns"), Ok)
        }
        _ => malformed("the matrix isn't square"),
    }
}

/// The precision in which the scalars of a matrix are computed: halves are rounded once, at the end.
fn working_precision(scalar: Scalar) -> Scalar {
    match scalar {
        Scalar::Float { width: 16 } => Scalar::Float { width: 32 },
        other => other,
    }
}

/// The determinant of a square matrix.
pub fn determinant(t: &mut Translator, scalar: Scalar, matrix: &Matrix) -> Result<Reg> {
    let working = working_precision(scalar);
    let all: Vec<usize> = (0..matrix.rows).collect();
    let columns: Vec<usize> = (0..matrix.columns).collect();
    let found = minor(t, working, matrix, &all, &columns)?;
    Ok(t.emit.wrap_to_width(scalar, found))
}

/// The inverse of a square matrix: its adjugate divided by its determinant.
pub fn inverse(t: &mut Translator, scalar: Scalar, matrix: &Matrix) -> Result<Vec<Reg>> {
    let (size, working) = (matrix.rows, working_precision(scalar));
    if size != matrix.columns {
        return malformed("the matrix isn't square");
    }
    let all = |without: usize| -> Vec<usize> { (0..size).filter(|index| *index != without).collect() };
    let mut adjugate = Vec::with_capacity(size * size);
    for column in 0..size {
        for row in 0..size {
            // Element (row, column) of the adjugate is the cofactor (column, row).
            let minor = minor(t, working, matrix, &all(column), &all(row))?;
            let odd = (row + column) % 2 == 1;
            adjugate.push(if odd { t.emit.op(op_for_width(scalar, Ir::FNeg, Ir::FNeg64), &[minor]) } else { minor });
        }
    }
    let first_row: Vec<Reg> = (0..size).map(|column| matrix.at(0, column)).collect();
    let determinant = dot(t, working, &first_row, &adjugate[..size], false)?;
    Ok(adjugate
        .into_iter()
        .map(|cofactor| {
            let element = t.emit.over(working, cofactor, determinant);
            t.emit.wrap_to_width(scalar, element)
        })
        .collect())
}
