//! The syntax tree of programs.

/// The number of elements of each function's array.
pub const ARRAY: usize = 4;
/// The number of variables of each function, without loop counters.
pub const VARIABLES: usize = 4;
/// The number of invocations that run each program.
pub const INVOCATIONS: usize = 64;

/// A program: the last function is called with an invocation's two inputs.
#[derive(Clone, Debug, Default)]
pub struct Program {
    /// Functions; each calls only those before it.
    pub functions: Vec<Function>,
}

/// A function of two parameters and a pointer to a variable of the caller.
#[derive(Clone, Debug, Default)]
pub struct Function {
    /// The statements of the function.
    pub body: Vec<Statement>,
    /// The value that it returns at its end.
    pub result: Expression,
    /// The number of its loops, each of which has a counter of its own.
    pub loops: usize,
}

/// A 32-bit value.
#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Expression {
    Constant(u32),
    Parameter(usize),
    Variable(usize),
    /// The value of the caller's variable.
    Borrowed,
    /// A loop's counter.
    Counter(usize),
    /// The element of the function's array at an index, which wraps.
    Element(Box<Self>),
    Binary(Binary, Box<Self>, Box<Self>),
    /// A choice; only the chosen side is computed.
    Choose(Box<Condition>, Box<Self>, Box<Self>),
}

impl Default for Expression {
    fn default() -> Self {
        Self::Constant(0)
    }
}

/// An operation.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Binary {
    Add,
    Subtract,
    Multiply,
    And,
    Or,
    Xor,
    /// Shifts by the low five bits of the right operand.
    ShiftLeft,
    /// Shifts by the low five bits of the right operand.
    ShiftRight,
    /// Divides by the right operand, made odd.
    Divide,
    /// The remainder of the division by the right operand, made odd.
    Remainder,
}

/// A comparison.
#[derive(Clone, Debug)]
pub struct Condition {
    /// The comparison operator.
    pub compare: Compare,
    /// Its left side.
    pub left: Expression,
    /// Its right side.
    pub right: Expression,
}

/// A comparison operator of two values.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Compare {
    Equal,
    NotEqual,
    Less,
    SignedLess,
    /// True if the values have a bit in common.
    Meet,
}

/// A statement. Nothing follows a break, a continue or a return in a list.
#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Statement {
    Assign(usize, Expression),
    /// Writes the caller's variable.
    Lend(Expression),
    /// Writes the array element at an index, which wraps.
    Store(Expression, Expression),
    /// Mixes a value into the invocation's hash, a variable of the module.
    Mix(Expression),
    Call {
        function: usize,
        arguments: [Expression; 2],
        lent: usize,
        to: usize,
    },
    If(Condition, Vec<Self>, Vec<Self>),
    Loop(Loop),
    Switch(Switch),
    /// Leaves the innermost loop or switch.
    Break,
    Continue,
    Return(Expression),
}

/// A loop with a counter from zero.
#[derive(Clone, Debug)]
pub struct Loop {
    /// The index of its counter.
    pub counter: usize,
    /// The loop ends at the latest when the counter reaches this value.
    pub count: u32,
    /// The further condition for continuing.
    pub condition: Condition,
    /// True if the condition is tested at the end of the body, false if before it.
    pub at_end: bool,
    /// Its body.
    pub body: Vec<Statement>,
    /// The statements before the next iteration, also after a continue. They contain no jumps.
    pub continuing: Vec<Statement>,
}

/// A switch.
#[derive(Clone, Debug)]
pub struct Switch {
    /// The value that selects a case.
    pub selector: Expression,
    /// Its cases in order.
    pub cases: Vec<Case>,
}

/// A case.
#[derive(Clone, Debug)]
pub struct Case {
    /// Its values; empty for the default case.
    pub values: Vec<u32>,
    /// Its body.
    pub body: Vec<Statement>,
    /// True if it falls through to the next case at its end.
    pub falls_through: bool,
}

/// The new hash after mixing a value into a hash.
pub(super) fn mixed(hash: u32, value: u32) -> u32 {
    (hash ^ value).wrapping_mul(0x0100_0193)
}
