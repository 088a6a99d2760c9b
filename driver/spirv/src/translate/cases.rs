//! The cases of a switch, in an order in which falling through means going on with the next.

use std::collections::{HashMap, HashSet};

use super::super::error::{Result, malformed, unsupported};
use super::super::instruction::{Instruction, Operand};
use super::structure::Structurizer;

/// The most blocks looked at while ordering the cases of switches.
const MAX_STEPS: usize = 1 << 22;

/// A target of a switch.
#[derive(Default)]
pub struct Target {
    pub block: usize,
    pub values: Vec<u32>,
    pub default: bool,
}

impl Structurizer<'_> {
    /// The targets of a switch, each once.
    pub fn switch_targets(&self, terminator: &Instruction) -> Result<Vec<Target>> {
        let mut targets: Vec<Target> = Vec::new();
        let mut by_block = HashMap::new();
        let mut values = HashSet::new();
        let mut target = |block| -> usize {
            *by_block.entry(block).or_insert_with(|| {
                targets.push(Target {
                    block,
                    ..Target::default()
                });
                targets.len() - 1
            })
        };
        let default = target(self.block_of(terminator.id(1)?)?);
        let mut found = Vec::new();
        for pair in terminator.operands.get(2..).unwrap_or_default().chunks(2) {
            match pair {
                [Operand::Literal(value), Operand::Id(label)] => {
                    if !values.insert(*value) {
                        return malformed(format!("two cases for {value}"));
                    }
                    found.push((target(self.block_of(*label)?), *value));
                }
                _ => return unsupported("a selector that isn't 32 bits"),
            }
        }
        targets[default].default = true;
        for (which, value) in found {
            targets[which].values.push(value);
        }
        Ok(targets)
    }

    /// The cases in an order in which each that falls through is followed by the one that it falls into; with each,
    /// whether it does.
    pub fn order_cases(&mut self, merge: usize, cases: &[Target]) -> Result<Vec<(usize, bool)>> {
        let which: HashMap<usize, usize> = cases
            .iter()
            .enumerate()
            .filter(|(_, case)| case.block != merge)
            .map(|(index, case)| (case.block, index))
            .collect();
        let mut falls_into = vec![None; cases.len()];
        let mut fallen_into = vec![false; cases.len()];
        for (index, case) in cases.iter().enumerate() {
            if case.block == merge || self.is_target(case.block) {
                continue;
            }
            for next in self.reachable_cases(case.block, merge, &which)? {
                if falls_into[index]
                    .replace(next)
                    .is_some_and(|other| other != next)
                    || std::mem::replace(&mut fallen_into[next], true)
                {
                    return malformed("cases fall through to each other in no order");
                }
            }
        }
        let mut order = Vec::with_capacity(cases.len());
        for head in (0..cases.len()).filter(|case| !fallen_into[*case]) {
            let mut at = Some(head);
            while let Some(case) = at {
                at = falls_into[case];
                order.push((case, at.is_some()));
            }
        }
        if order.len() != cases.len() {
            return malformed("cases fall through to each other in a circle");
        }
        Ok(order)
    }

    /// The other cases that a case reaches without leaving the switch.
    fn reachable_cases(
        &mut self,
        start: usize,
        merge: usize,
        which: &HashMap<usize, usize>,
    ) -> Result<HashSet<usize>> {
        let mut found = HashSet::new();
        let mut seen = HashSet::from([start]);
        let mut waiting = vec![start];
        while let Some(block) = waiting.pop() {
            self.steps += 1;
            if self.steps > MAX_STEPS {
                return unsupported("too many blocks in switches");
            }
            let terminator = self.terminator(block)?.clone();
            for label in terminator.operands.iter().filter_map(Operand::id) {
                let Some(next) = self.index.get(&label).copied() else {
                    continue;
                };
                if next == merge || next == start || self.is_target(next) {
                    continue;
                }
                if let Some(case) = which.get(&next) {
                    found.insert(*case);
                } else if seen.insert(next) {
                    waiting.push(next);
                }
            }
        }
        Ok(found)
    }
}
