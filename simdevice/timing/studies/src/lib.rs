//! Studies of the simulated GauRast hardware with the timing model, which does not depend on them: the paper's numbers
//! compared with the model's, sweeps over the hardware's numbers, the gain of each skip of the device as hardware,
//! area, charts, other ways to draw Gaussians ([`simt`], [`rivals`], [`techniques`]). Also the references that tests compare the model
//! with: [`stepped`] cycle by cycle, [`pe`] and [`module`] bit by bit, and [`rtl`], the module in SystemVerilog.
#![forbid(unsafe_code)]

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
pub mod techniques;
pub mod what_if;
