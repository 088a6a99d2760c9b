//! Nothing but tests: see `tests/arrows`.
