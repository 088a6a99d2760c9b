//! Scopes of variables: the part of the statement tree in which each is used.

use std::collections::{HashMap, HashSet};

use crate::ir::{Block, Label, Program, Reg, Role, Statement};

/// The scope of each variable.
///
/// A variable's scope is the innermost block around all statements that read or assign it, if the first of them in the
/// block assigns it unconditionally. A lane that enters the scope then reads nothing from an earlier visit: only masks
/// that change within the scope matter to the variable. Otherwise the scope is the whole program.
pub struct VariableScopes {
    variables: HashMap<Reg, Uses>,
}

/// A block's place in the statement around it: the statement's number in order of appearance, and the block's index in
/// it.
type Step = (usize, usize);

struct Uses {
    /// The path to the scope: blocks, outermost first.
    scope: Vec<Step>,
    /// The number of constructs around the scope; none if it is the whole program.
    depth: usize,
    /// The labelled constructs around all reads.
    around_reads: Option<Vec<Label>>,
}

impl VariableScopes {
    /// The number of constructs around a variable's scope.
    pub fn depth(&self, variable: Reg) -> usize {
        self.variables.get(&variable).map_or(0, |uses| uses.depth)
    }

    /// Reports whether a variable is read outside a construct.
    pub fn is_read_outside(&self, variable: Reg, label: Label) -> bool {
        let uses = self.variables.get(&variable);
        let around = uses.and_then(|uses| uses.around_reads.as_ref());
        !around.is_some_and(|around| around.contains(&label))
    }
}

/// Finds the scopes of a program's variables.
pub fn variable_scopes(program: &Program) -> VariableScopes {
    let mut search = Search { program, variables: HashMap::new(), path: Vec::new(), labels: Vec::new(), statements: 0 };
    // The caller sets and reads outputs: their scope is the whole program.
    for output in &program.outputs {
        search.touch(output.reg);
        search.read(output.reg);
    }
    search.block(&program.body);
    let mut scopes = VariableScopes { variables: search.variables };
    let mut first = FirstUse { scopes: &mut scopes, path: Vec::new(), statements: 0, depth: 0 };
    first.block(&program.body);
    scopes
}

struct Search<'a> {
    program: &'a Program,
    variables: HashMap<Reg, Uses>,
    path: Vec<Step>,
    labels: Vec<Label>,
    statements: usize,
}

impl Search<'_> {
    fn is_variable(&self, reg: Reg) -> bool {
        self.program.registers[reg.0 as usize].role == Role::Variable
    }

    fn touch(&mut self, reg: Reg) {
        let path = &self.path;
        let uses =
            self.variables.entry(reg).or_insert_with(|| Uses { scope: path.clone(), depth: 0, around_reads: None });
        let common = uses.scope.iter().zip(path).take_while(|(a, b)| a == b);
        let common = common.count();
        uses.scope.truncate(common);
    }

    fn read(&mut self, reg: Reg) {
        let labels = &self.labels;
        if let Some(uses) = self.variables.get_mut(&reg) {
            match &mut uses.around_reads {
                Some(around) => around.retain(|label| labels.contains(label)),
                none => *none = Some(labels.clone()),
            }
        }
    }

    fn block(&mut self, block: &Block) {
        for statement in block {
            let number = self.statements;
            self.statements += 1;
            for reg in statement.uses() {
                if self.is_variable(reg) {
                    self.touch(reg);
                    self.read(reg);
                }
            }
            for reg in statement.definitions() {
                if self.is_variable(reg) {
                    self.touch(reg);
                }
            }
            let label = label_of(statement);
            self.labels.extend(label);
            for (index, inner) in statement.blocks().into_iter().enumerate() {
                self.path.push((number, index));
                self.block(inner);
                self.path.pop();
            }
            if label.is_some() {
                self.labels.pop();
            }
        }
    }
}

/// Finds the scopes that begin with an assignment.
struct FirstUse<'a> {
    scopes: &'a mut VariableScopes,
    path: Vec<Step>,
    statements: usize,
    /// Constructs around this place. As in uniformity analysis, a switch's cases are branches in it.
    depth: usize,
}

impl FirstUse<'_> {
    /// Walks a block. Returns the variables used in it.
    fn block(&mut self, block: &Block) -> Vec<Reg> {
        let mut used: Vec<Reg> = Vec::new();
        for statement in block {
            let number = self.statements;
            self.statements += 1;
            let mut here = statement.uses();
            let levels = 1 + usize::from(matches!(statement, Statement::Switch { .. }));
            for (index, inner) in statement.blocks().into_iter().enumerate() {
                self.path.push((number, index));
                self.depth += levels;
                here.extend(self.block(inner));
                self.depth -= levels;
                self.path.pop();
            }
            if let Statement::Assign { dst, .. } = statement
                && !used.contains(dst)
                && !here.contains(dst)
                && let Some(uses) = self.scopes.variables.get_mut(dst)
                && uses.scope == self.path
            {
                uses.depth = self.depth;
            }
            here.extend(statement.definitions());
            here.retain(|reg| self.scopes.variables.contains_key(reg));
            used.append(&mut here);
            used.sort_unstable();
            used.dedup();
        }
        used
    }
}

fn label_of(statement: &Statement) -> Option<Label> {
    match statement {
        Statement::Loop { label, .. } | Statement::Scope { label, .. } | Statement::Switch { label, .. } => {
            Some(*label)
        }
        _ => None,
    }
}

/// For each loop, the variables that only the loop reads, and that every lane which enters it has assigned just before,
/// in the block that the loop is in.
///
/// An assignment normally needs a mask, because lanes that have left a loop may read the variable later. These
/// variables need none: their new values may be written in all lanes.
pub fn loop_private_variables(program: &Program) -> HashMap<Label, HashSet<Reg>> {
    let mut reads = HashMap::new();
    count_reads(program, &program.body, &mut reads);
    for output in &program.outputs {
        *reads.entry(output.reg).or_default() += 1;
    }
    let mut found = HashMap::new();
    search_loops(program, &program.body, &reads, &mut found);
    found
}

/// Counts reads of variables.
fn count_reads(program: &Program, block: &Block, reads: &mut HashMap<Reg, usize>) {
    for statement in block {
        for reg in statement.uses() {
            if program.registers[reg.0 as usize].role == Role::Variable {
                *reads.entry(reg).or_default() += 1;
            }
        }
        statement.blocks().into_iter().for_each(|block| count_reads(program, block, reads));
    }
}

fn search_loops(
    program: &Program,
    block: &Block,
    reads: &HashMap<Reg, usize>,
    found: &mut HashMap<Label, HashSet<Reg>>,
) {
    let mut assigned = HashSet::new();
    for statement in block {
        match statement {
            Statement::Assign { dst, .. } => {
                assigned.insert(*dst);
            }
            Statement::Loop { label, .. } => {
                let mut within = HashMap::new();
                statement.blocks().into_iter().for_each(|block| count_reads(program, block, &mut within));
                let private =
                    within.iter().filter(|(reg, count)| assigned.contains(*reg) && reads.get(*reg) == Some(*count));
                found.insert(*label, private.map(|(reg, _)| *reg).collect());
            }
            _ => {}
        }
        statement.blocks().into_iter().for_each(|block| search_loops(program, block, reads, found));
    }
}
