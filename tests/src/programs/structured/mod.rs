//! Random structured programs: nested loops and switches with fallthrough, breaks, continues and returns wherever they
//! are allowed, calls, and arrays indexed at run time. [`generate`] makes them, [`run`] interprets them, and
//! [`assemble`] writes them as SPIR-V.

mod assemble;
mod generate;
mod interpret;
mod program;

pub use assemble::assemble;
pub use generate::generate;
pub use interpret::run;
pub use program::{
    ARRAY, Binary, Case, Compare, Condition, Expression, Function, INVOCATIONS, Loop, Program, Statement, Switch,
    VARIABLES,
};
