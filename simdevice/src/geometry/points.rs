//! Vertex shading alone: runs the vertex program of a draw of points and returns its outputs. Gaussian draws use it to
//! project Gaussians.

use super::fetch::Fetcher;
use super::shade::{OutputReader, Shaded, Shader};
use super::vertex_reuse::{RestartRun, VertexReuse};
use super::viewport::Transform;
use crate::packet::Draw;
use crate::runtime::Runtime;
use crate::stats::counters::{Counter, Counters};
use isa::machine::{Stopped, Watchdog};
use isa::resources::Resources;
use std::sync::atomic::AtomicBool;

/// Runs the vertex program of a draw whose topology is the point list.
pub(crate) struct PointShader<'a> {
    draw: &'a Draw,
    shader: Shader<'a>,
    reuse: VertexReuse,
    shaded: Shaded,
}

impl<'a> PointShader<'a> {
    /// Prepares a machine for view number `view`. Setting `cancel` stops it.
    pub(crate) fn new(
        draw: &'a Draw,
        view: u32,
        runtime: &Runtime,
        resources: &'a Resources<'a>,
        cancel: &'a AtomicBool,
    ) -> Self {
        let program = &draw.pipeline.vertex;
        let mut machine = program.machines.lend();
        Self {
            draw,
            shader: Shader {
                fetcher: Fetcher::new(draw, view, &mut machine),
                machine,
                reader: OutputReader {
                    outputs: &program.outputs,
                    takes_optional: false,
                    level: runtime.level(),
                    transform: Transform::NONE,
                },
                resources,
                watchdog: Watchdog { limit: runtime.config().shader_timeout, cancel: Some(cancel) },
            },
            reuse: VertexReuse::default(),
            shaded: Shaded::default(),
        }
    }

    /// True if the program writes a varying.
    pub(crate) fn writes(&self, varying: u32) -> bool {
        let varyings = &self.shader.reader.outputs.varyings;
        varyings.get(varying as usize).is_some_and(Option::is_some)
    }

    /// Shades points `first..end` of an instance, counted from the draw's first. Each distinct vertex is shaded once.
    ///
    /// # Errors
    /// [`Stopped`] if the program ran for too long.
    pub(crate) fn shade(
        &mut self,
        instance: u32,
        first: u32,
        end: u32,
        counters: &mut Counters,
    ) -> Result<(), Stopped> {
        let run = RestartRun { start: 0, primitives_before: 0, primitives: self.draw.count, vertices: self.draw.count };
        self.reuse.clear();
        self.reuse.push(self.draw, &run, instance, first, end);
        let ran = self.shader.shade(&self.reuse, &mut self.shaded);
        counters.add_work(&self.shader.machine.take_work());
        let invocations = self.reuse.vertices.len() as u64;
        counters.add(Counter::VertexInvocations, invocations);
        ran
    }

    /// The position in clip space and the varyings of each point that was shaded last, in order.
    pub(crate) fn points(&self) -> impl Iterator<Item = ([f32; 4], &[u32])> {
        let pieces = self.reuse.pieces.iter();
        let slots =
            pieces.flat_map(|piece| (piece.first..piece.end).map(|place| self.reuse.slot(piece, place) as usize));
        let per_vertex = self.shader.reader.outputs.varyings.len();
        slots.map(move |slot| {
            let varyings = &self.shaded.varyings[slot * per_vertex..(slot + 1) * per_vertex];
            (self.shaded.vertices[slot].position, varyings)
        })
    }
}
