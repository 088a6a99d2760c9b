//! Structured programs at random: nested loops and switches with fallthrough, breaks, continues and returns wherever
//! they may be, calls, and arrays indexed at run time. One thing makes them ([`generate`]), another says what they
//! compute ([`run`]), and a third writes them as SPIR-V ([`assemble`]).

mod assemble;
mod generate;
mod interpret;
mod program;

pub use assemble::assemble;
pub use generate::generate;
pub use interpret::run;
pub use program::{
    ARRAY, Binary, Case, Compare, Condition, Expression, Function, INVOCATIONS, Loop, Program,
    Statement, Switch, VARIABLES,
};
