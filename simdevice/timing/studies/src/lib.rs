//! Studies of the simulated GauRast hardware, on top of the timing model, which knows none of them: the paper's numbers
//! beside the model's, sweeps over the machine's numbers, what each skip of the device would bring as hardware, area, charts,
//! other ways to draw Gaussians ([`simt`], [`rivals`]); and the references that the model is held against, [`stepped`] cycle by cycle,
//! [`pe`] and [`module`] bit by bit, and [`rtl`], the module in SystemVerilog.
#![forbid(unsafe_code)]

pub mod area;
pub mod chart;
pub mod exponential;
pub mod module;
pub mod number;
pub mod paper;
pub mod pe;
pub mod rivals;
pub mod rtl;
pub mod rtl_cycles;
pub mod scatter;
pub mod scene;
pub mod sensitivity;
pub mod simt;
pub mod stepped;
pub mod what_if;
