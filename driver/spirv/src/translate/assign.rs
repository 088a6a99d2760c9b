//! Assignments that happen at once.

use std::collections::{HashMap, VecDeque};

use isa::ir::Reg;

use super::super::error::Result;
use super::Translator;

impl Translator<'_> {
    /// Assignments at once: every source is read before any destination is written.
    pub fn assign(&mut self, mut pairs: Vec<(Reg, Reg)>) -> Result<()> {
        pairs.retain(|(dst, src)| dst != src);
        self.charge_budget(pairs.len())?;
        let mut readers: HashMap<Reg, Vec<usize>> = HashMap::new();
        for (index, (_, src)) in pairs.iter().enumerate() {
            readers.entry(*src).or_default().push(index);
        }
        let mut waiting: HashMap<Reg, usize> = readers
            .iter()
            .map(|(reg, readers)| (*reg, readers.len()))
            .collect();
        let by_dst: HashMap<Reg, usize> = pairs
            .iter()
            .enumerate()
            .map(|(index, (dst, _))| (*dst, index))
            .collect();
        let mut done = vec![false; pairs.len()];
        let mut ready: VecDeque<usize> = (0..pairs.len())
            .filter(|index| !readers.contains_key(&pairs[*index].0))
            .collect();
        let mut next_cycle = 0;
        loop {
            while let Some(index) = ready.pop_front() {
                let (dst, src) = pairs[index];
                done[index] = true;
                self.builder.assign(dst, src);
                if let Some(left) = waiting.get_mut(&src) {
                    *left -= 1;
                    if *left == 0
                        && let Some(freed) = by_dst.get(&src)
                        && !done[*freed]
                    {
                        ready.push_back(*freed);
                    }
                }
            }
            // What is left are cycles: hold one register's old value for its readers.
            while next_cycle < pairs.len() && done[next_cycle] {
                next_cycle += 1;
            }
            let Some((held, _)) = pairs.get(next_cycle).copied() else {
                return Ok(());
            };
            let copy = self.builder.variable(self.builder.type_of(held));
            self.builder.assign(copy, held);
            for index in readers.remove(&held).unwrap_or_default() {
                pairs[index].1 = copy;
            }
            ready.push_back(next_cycle);
        }
    }
}
