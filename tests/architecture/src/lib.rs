//! An empty library: the package consists of the tests in `tests/arrows`.
