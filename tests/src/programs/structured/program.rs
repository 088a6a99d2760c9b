//! Programs.

/// Elements of each function's array.
pub const ARRAY: usize = 4;
/// Variables of each function, without loop counters.
pub const VARIABLES: usize = 4;
/// Invocations that run each program.
pub const INVOCATIONS: usize = 64;

/// A program: the last function is called with an invocation's two inputs.
#[derive(Clone, Debug, Default)]
pub struct Program {
    /// Functions; each calls only those before it.
    pub functions: Vec<Function>,
}

/// A function of two parameters and a variable of the caller's, which it may write.
#[derive(Clone, Debug, Default)]
pub struct Function {
    /// What it does.
    pub body: Vec<Statement>,
    /// What it returns at its end.
    pub result: Expression,
    /// How many loops it has: each has a counter of its own.
    pub loops: usize,
}

/// A 32-bit value.
#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Expression {
    Constant(u32),
    Parameter(usize),
    Variable(usize),
    /// The caller's variable.
    Borrowed,
    /// A loop's counter.
    Counter(usize),
    /// The element of the function's array at an index, which wraps.
    Element(Box<Self>),
    Binary(Binary, Box<Self>, Box<Self>),
    /// Only the chosen one is computed.
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
    /// By the low five bits.
    ShiftLeft,
    /// By the low five bits.
    ShiftRight,
    /// By what is made odd first.
    Divide,
    /// By what is made odd first.
    Remainder,
}

/// A comparison.
#[derive(Clone, Debug)]
pub struct Condition {
    /// Which.
    pub compare: Compare,
    /// Its left side.
    pub left: Expression,
    /// Its right side.
    pub right: Expression,
}

/// How two values are compared.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Compare {
    Equal,
    NotEqual,
    Less,
    SignedLess,
    /// Whether they have a bit in common.
    Meet,
}

/// A statement. After a break, a continue or a return nothing follows in a list.
#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Statement {
    Assign(usize, Expression),
    /// Writes the caller's variable.
    Lend(Expression),
    /// Writes the array at an index, which wraps.
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
    /// Its counter.
    pub counter: usize,
    /// It ends when the counter reaches this, at the latest.
    pub count: u32,
    /// What else must hold to go on.
    pub condition: Condition,
    /// Whether that is asked at the end of the body instead of before it.
    pub at_end: bool,
    /// Its body.
    pub body: Vec<Statement>,
    /// What is done before the next round, after a continue too: nothing that jumps.
    pub continuing: Vec<Statement>,
}

/// A switch.
#[derive(Clone, Debug)]
pub struct Switch {
    /// What is looked for.
    pub selector: Expression,
    /// Its cases in order.
    pub cases: Vec<Case>,
}

/// A case.
#[derive(Clone, Debug)]
pub struct Case {
    /// Its values; none for the default.
    pub values: Vec<u32>,
    /// Its body.
    pub body: Vec<Statement>,
    /// Whether it goes on with the next case, if it comes to its end.
    pub falls_through: bool,
}

/// What a value becomes that is mixed into a hash.
pub(super) fn mixed(hash: u32, value: u32) -> u32 {
    (hash ^ value).wrapping_mul(0x0100_0193)
}
