//! The disassembly: programs as text, for people.

use std::fmt::{Display, Formatter, Result};

use super::ir::{Address, Binding, Block, Program, Reg, Space, Statement, SubgroupOp, Type};

impl Display for Reg {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "%{}", self.0)
    }
}

impl Display for Program {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        for input in &self.inputs {
            writeln!(f, "{} = input {} {:?}", input.reg, input.slot, input.rate)?;
        }
        for output in &self.outputs {
            writeln!(f, "{} = output {}", output.reg, output.slot)?;
        }
        if self.shared_bytes + self.private_bytes > 0 {
            writeln!(
                f,
                "shared {} bytes, private {} bytes",
                self.shared_bytes, self.private_bytes
            )?;
        }
        for constant in &self.constants {
            let bits = constant.bits;
            match self
                .registers
                .get(constant.reg.0 as usize)
                .map(|register| register.ty)
            {
                Some(Type::Bool) => writeln!(f, "{} = {}", constant.reg, bits != 0)?,
                Some(Type::B64) => {
                    writeln!(f, "{} = {bits} ({:?})", constant.reg, f64::from_bits(bits))?;
                }
                _ => writeln!(
                    f,
                    "{} = {bits} ({:?})",
                    constant.reg,
                    f32::from_bits(bits as u32)
                )?,
            }
        }
        block(&self.body, 0, f)
    }
}

impl Display for Statement {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        statement(self, 0, f)
    }
}

fn block(statements: &Block, depth: usize, f: &mut Formatter<'_>) -> Result {
    statements
        .iter()
        .try_for_each(|inner| statement(inner, depth, f))
}

fn statement(it: &Statement, depth: usize, f: &mut Formatter<'_>) -> Result {
    let pad = "  ".repeat(depth);
    write!(f, "{pad}")?;
    let defined = it.definitions();
    if !defined.is_empty() {
        write!(f, "{} = ", List(&defined))?;
    }
    match it {
        Statement::Compute { op, src, .. } => writeln!(f, "{} {}", op.name(), List(src)),
        Statement::Assign { src, .. } => writeln!(f, "assign {src}"),
        Statement::LaneIndex { .. } => writeln!(f, "lane_index"),
        Statement::IsHelper { .. } => writeln!(f, "is_helper"),
        Statement::Load {
            address, format, ..
        } => writeln!(f, "load {format:?} {address}"),
        Statement::Store {
            src,
            address,
            format,
        } => writeln!(f, "store {format:?} {address}, {}", List(src)),
        Statement::Atomic {
            op,
            address,
            format,
            value,
            comparator,
            ..
        } => {
            write!(f, "atomic {op:?} {format:?} {address}, {value}")?;
            match comparator {
                Some(comparator) => writeln!(f, ", {comparator}"),
                None => writeln!(f),
            }
        }
        Statement::BufferSize { buffer, .. } => writeln!(f, "buffer_size {buffer}"),
        Statement::Sample(sample) => {
            write!(
                f,
                "sample {:?} {} {}, {}",
                sample.shape,
                sample.image,
                sample.sampler,
                List(&sample.coordinate)
            )?;
            writeln!(
                f,
                ", {:?}, offset [{}], compare {:?}, gather {:?}",
                sample.lod,
                List(&sample.offset),
                sample.compare,
                sample.gather
            )
        }
        Statement::ImageRead(read) => {
            write!(
                f,
                "image_read {:?} {}, {}",
                read.shape,
                read.image,
                List(&read.coordinate)
            )?;
            writeln!(f, ", level {:?}, sample {:?}", read.level, read.sample)
        }
        Statement::ImageWrite(write) => {
            let ir = (&write.coordinate, &write.texel);
            writeln!(
                f,
                "image_write {:?} {}, {}: {}",
                write.shape,
                write.image,
                List(ir.0),
                List(ir.1)
            )
        }
        Statement::ImageAtomic(atomic) => {
            write!(
                f,
                "image_atomic {:?} {:?} {}",
                atomic.op, atomic.shape, atomic.image
            )?;
            writeln!(
                f,
                ", {}: {}, {:?}",
                List(&atomic.coordinate),
                atomic.value,
                atomic.comparator
            )
        }
        Statement::ImageQuery {
            image,
            shape,
            query,
            ..
        } => writeln!(f, "image_query {shape:?} {image}, {query:?}"),
        Statement::Derivative {
            src, axis, fine, ..
        } => {
            writeln!(
                f,
                "derivative_{} {axis:?} {src}",
                if *fine { "fine" } else { "coarse" }
            )
        }
        Statement::Subgroup { op, src, index, .. } => {
            match op {
                SubgroupOp::Reduce { op, cluster } => {
                    write!(f, "subgroup reduce {} {cluster}", op.name())?;
                }
                other => write!(f, "subgroup {other:?}")?,
            }
            let operands: Vec<Reg> = src.iter().chain(index).copied().collect();
            writeln!(f, " {}", List(&operands))
        }
        Statement::Barrier => writeln!(f, "barrier"),
        Statement::If {
            condition,
            then,
            otherwise,
        } => {
            writeln!(f, "if {condition} {{")?;
            block(then, depth + 1, f)?;
            if !otherwise.is_empty() {
                writeln!(f, "{pad}}} else {{")?;
                block(otherwise, depth + 1, f)?;
            }
            writeln!(f, "{pad}}}")
        }
        Statement::Switch {
            label,
            selector,
            cases,
        } => {
            writeln!(f, "@{} switch {selector} {{", label.0)?;
            for case in cases {
                let default = if case.default { " default" } else { "" };
                writeln!(f, "{pad}case {:?}{default} {{", case.values)?;
                block(&case.body, depth + 1, f)?;
                writeln!(
                    f,
                    "{pad}}}{}",
                    if case.fallthrough {
                        " fall through"
                    } else {
                        ""
                    }
                )?;
            }
            writeln!(f, "{pad}}}")
        }
        Statement::Loop {
            label,
            body,
            continuing,
        } => {
            writeln!(f, "@{} loop {{", label.0)?;
            block(body, depth + 1, f)?;
            if !continuing.is_empty() {
                writeln!(f, "{pad}}} continuing {{")?;
                block(continuing, depth + 1, f)?;
            }
            writeln!(f, "{pad}}}")
        }
        Statement::Scope { label, body } => {
            writeln!(f, "@{} scope {{", label.0)?;
            block(body, depth + 1, f)?;
            writeln!(f, "{pad}}}")
        }
        Statement::Break(label) => writeln!(f, "break @{}", label.0),
        Statement::Continue(label) => writeln!(f, "continue @{}", label.0),
        Statement::Return => writeln!(f, "return"),
        Statement::Kill => writeln!(f, "kill"),
        Statement::Demote => writeln!(f, "demote"),
    }
}

struct List<'a>(&'a [Reg]);

impl Display for List<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        for (index, reg) in self.0.iter().enumerate() {
            write!(f, "{}{reg}", if index > 0 { ", " } else { "" })?;
        }
        Ok(())
    }
}

impl Display for Binding {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "#{}", self.slot)?;
        match self.index {
            Some(index) => write!(f, "[{index} of {}]", self.count),
            None => Ok(()),
        }
    }
}

impl Display for Address {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match &self.space {
            Space::Buffer(binding) => write!(f, "buffer{binding}")?,
            Space::PushConstants => write!(f, "push")?,
            Space::Shared => write!(f, "shared")?,
            Space::Private => write!(f, "private")?,
            Space::Global => write!(f, "global")?,
        }
        match self.base {
            Some(base) => write!(f, "[{base} + {}]", self.offset),
            None => write!(f, "[{}]", self.offset),
        }
    }
}
