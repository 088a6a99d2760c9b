//! What the program leaves in its outputs.

use spirv::{BuiltIn as Spirv, StorageClass};

use super::super::error::{Result, malformed, unsupported};
use super::super::interface::{BuiltIn, Output, OutputTarget};
use super::Translator;
use super::built_in::IoLocation;
use super::resource::numeric;

impl Translator<'_> {
    /// Assigns what was stored to the output variables.
    pub fn assign_outputs(&mut self) -> Result<()> {
        let mut outputs: Vec<u32> = self.analysis.used.iter().copied().collect();
        outputs.retain(|id| {
            let class = self.globals.variables.get(id).map(|it| it.class);
            class == Some(StorageClass::Output)
        });
        outputs.sort_unstable();
        for variable in outputs {
            let Some(slot) = self.slot_of_root(variable) else {
                continue;
            };
            let io_locations = self.io_locations(variable)?;
            for (index, io_location) in io_locations.iter().enumerate() {
                if !self.slots[slot].written[index] {
                    continue;
                }
                let scalar = self.slots[slot].scalars[index];
                let target = output_target(*io_location)?;
                if self.interface.outputs.iter().any(|it| it.target == target) {
                    return malformed(format!("two outputs at {target:?}"));
                }
                let reg = self.read_scalar(slot, index)?;
                let output = self
                    .builder
                    .output(self.interface.outputs.len() as u32, scalar.register());
                self.interface.outputs.push(Output {
                    target,
                    numeric: numeric(scalar),
                });
                self.builder.assign(output, reg);
            }
        }
        Ok(())
    }
}

fn output_target(io_location: IoLocation) -> Result<OutputTarget> {
    Ok(match io_location {
        IoLocation::Location {
            location,
            component,
            index,
            ..
        } => OutputTarget::Location {
            location,
            component,
            index,
        },
        IoLocation::BuiltIn {
            built_in,
            component,
        } => OutputTarget::BuiltIn {
            built_in: match built_in {
                Spirv::Position => BuiltIn::Position,
                Spirv::PointSize => BuiltIn::PointSize,
                Spirv::ClipDistance => BuiltIn::ClipDistance,
                Spirv::CullDistance => BuiltIn::CullDistance,
                Spirv::Layer => BuiltIn::Layer,
                Spirv::ViewportIndex => BuiltIn::ViewportIndex,
                Spirv::FragDepth => BuiltIn::FragDepth,
                Spirv::SampleMask => BuiltIn::SampleMask,
                other => return unsupported(format!("output built-in {other:?}")),
            },
            component,
        },
    })
}
