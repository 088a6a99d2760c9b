//! Prints RIVALS.md.

use std::error::Error;
use timing_studies::techniques::measured::Stored;
use timing_studies::techniques::page;

fn main() -> Result<(), Box<dyn Error>> {
    print!("{}", page::markdown(&Stored::load()?)?);
    Ok(())
}
