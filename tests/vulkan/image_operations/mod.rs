//! The chapter *Image Operations*.

mod kernels;
mod storage;
mod storing;
