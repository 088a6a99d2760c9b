//! The outputs that both modes share: tile buffers, attachments, and the sources of fragments' colours.

use crate::program::fragment::FragmentStage;
use crate::raster::color::ColorOutput;
use crate::raster::tile::Tile;
use crate::raster::tile_buffer::{Target, TileBuffer};
use crate::simd::as_floats;
use crate::state::{BlendState, LogicOp};
use fearless_simd::Simd;
use fearless_simd::prelude::*;
use isa::Vector;
use isa::machine::Machine;

/// The components of both sources of an attachment, by chunk of 16 lanes. Components that are not written are empty.
pub type Sources<'a> = [[&'a [Vector]; 4]; 2];

/// The lanes that alpha to coverage covers, for each sample of a pixel.
#[inline(always)]
pub fn covered_by_alpha<S: Simd>(simd: S, alpha: &Vector, samples: usize) -> [u16; 4] {
    let alpha = as_floats(simd, alpha);
    if samples == 1 {
        return [alpha.simd_ge(0.5).to_bitmask() as u16; 4];
    }
    let mut covered = [0; 4];
    for (sample, lanes) in covered.iter_mut().enumerate() {
        *lanes = alpha.simd_gt(sample as f32 / 4.0).to_bitmask() as u16;
    }
    covered
}

/// The values that a program wrote to a slot; empty without a slot.
pub fn lanes_of(machine: &Machine, slot: Option<u32>) -> &[Vector] {
    slot.map_or(&[], |slot| machine.output_vectors(slot))
}

/// The tile buffers of a worker.
#[derive(Debug)]
pub struct Buffers {
    pub color: Vec<TileBuffer>,
    pub depth: TileBuffer,
    pub stencil: TileBuffer,
}

impl Buffers {
    /// Writes a tile to the memory of all attachments that it may differ from, and keeps it.
    pub fn write_through(&mut self, targets: Targets<'_>, layer: u32, tile: &Tile) {
        let colors = self.color.iter_mut().zip(targets.color.iter().map(Option::as_ref));
        let rest = [(&mut self.depth, targets.depth), (&mut self.stencil, targets.stencil)];
        for (buffer, target) in colors.chain(rest) {
            if let Some(target) = target {
                buffer.write_through(target, layer, tile);
            }
        }
    }
}

/// The attachments of a pass.
#[derive(Clone, Copy, Debug)]
pub struct Targets<'a> {
    pub color: &'a [Option<Target>],
    pub depth: Option<&'a Target>,
    pub stencil: Option<&'a Target>,
}

/// The outputs to the attachments that a program writes to.
pub(super) fn color_outputs(
    stage: Option<&FragmentStage>,
    targets: &[Option<Target>],
    blend: &[BlendState],
    logic: Option<LogicOp>,
    constants: [f32; 4],
) -> Vec<Option<ColorOutput>> {
    const REPLACE: BlendState = BlendState { equations: None, write_mask: 0xF };
    let color = |(index, target): (usize, &Option<Target>)| {
        let written = stage?.interface.colors.get(index)?;
        written.iter().flatten().flatten().next()?;
        let blend = blend.get(index).unwrap_or(&REPLACE);
        ColorOutput::new(blend, logic, constants, target.as_ref()?.format())
    };
    targets.iter().enumerate().map(color).collect()
}
