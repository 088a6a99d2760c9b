//! Set-up: assembled primitives are clipped, culled and become what the rasterizer takes.

use super::assemble::{corner_count, corners};
use super::bins::{Grid, Pair};
use super::clip::{ClipVertex, Clipper};
use super::depth_bias::{self, DepthUnit};
use super::elements::Elements;
use super::pipeline::VertexOutputs;
use super::primitive::Primitive;
use super::shade::{Extras, NO_EXTRAS, Shaded, Vertex};
use super::viewport::{Projected, Transform, code};
use crate::packet::Rect;
use crate::packet::draw::{DrawState, PolygonMode};

/// What a chunk of primitives became. Vertices and primitives are numbered from 0.
#[derive(Debug, Default)]
pub(super) struct Output {
    pub primitives: Vec<Primitive>,
    pub varyings: Vec<u32>,
    pub pairs: Vec<Pair>,
    /// Vertices in `varyings`, even if they have none.
    pub vertices: u32,
    /// Primitives that were assembled.
    pub assembled: u64,
    /// Primitives that clipping left.
    pub clipped: u64,
}

/// What set-up needs to know of a draw.
pub(super) struct Setup<'a> {
    pub state: &'a DrawState,
    pub outputs: &'a VertexOutputs,
    /// By viewport.
    pub transforms: &'a [Transform],
    /// The pixels that may be touched, by viewport.
    pub regions: &'a [Rect],
    pub grid: Grid,
    pub layers: u32,
    pub depth_unit: DepthUnit,
}

/// A chunk being set up.
pub(super) struct Job<'a> {
    pub(super) setup: &'a Setup<'a>,
    pub(super) shaded: &'a Shaded,
    /// By slot: the vertex's number in the output, or [`NONE`].
    pub(super) numbers: &'a mut Vec<u32>,
    pub(super) out: Output,
}

/// A vertex that has no number yet.
pub(super) const NONE: u32 = u32::MAX;

/// The primitive being set up.
#[derive(Clone, Copy)]
pub(super) struct Current {
    pub id: u32,
    /// Slots of its corners.
    pub slots: [u32; 3],
    /// The provoking vertex's slot.
    pub provoking: u32,
    pub viewport: u8,
    pub layer: u16,
    pub front: bool,
}

/// A vertex of a primitive after clipping.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub projected: Projected,
    pub origin: Origin,
}

#[derive(Clone, Copy)]
pub(super) enum Origin {
    /// A shaded vertex, by slot.
    Slot(u32),
    /// A mixture of the primitive's corners, already in the output.
    New { number: u32 },
}

impl<'a> Job<'a> {
    pub(super) fn new(setup: &'a Setup<'a>, shaded: &'a Shaded, numbers: &'a mut Vec<u32>) -> Self {
        numbers.clear();
        numbers.resize(shaded.vertices.len(), NONE);
        Self {
            setup,
            shaded,
            numbers,
            out: Output::default(),
        }
    }

    /// Sets up all primitives of a chunk.
    pub(super) fn run(mut self, elements: &Elements) -> Output {
        let state = self.setup.state;
        let count = corner_count(state.topology);
        for piece in &elements.pieces {
            for number in piece.first..piece.end {
                let found = corners(state.topology, state.provoking_last, number);
                let slots = found.places.map(|place| elements.slot(piece, place));
                let mut current = Current {
                    id: piece.primitives_before.wrapping_add(number),
                    slots,
                    provoking: slots[found.provoking],
                    viewport: 0,
                    layer: 0,
                    front: true,
                };
                self.choose_target(&mut current);
                match count {
                    1 => self.point(&current),
                    2 => self.line(&current),
                    _ => self.triangle(&mut current),
                }
            }
            self.out.assembled += u64::from(piece.end - piece.first);
        }
        self.out
    }

    pub(super) fn extras(&self, slot: u32) -> &Extras {
        self.shaded.extras.get(slot as usize).unwrap_or(&NO_EXTRAS)
    }

    /// The provoking vertex says which layer and viewport a primitive is drawn to; what doesn't exist is the last
    /// layer, or the first viewport.
    fn choose_target(&self, current: &mut Current) {
        if self.shaded.extras.is_empty() {
            return;
        }
        let extras = self.extras(current.provoking);
        let layer = extras.layer.min(self.setup.layers.saturating_sub(1));
        current.layer = layer.min(u16::MAX.into()) as u16;
        if (extras.viewport as usize) < self.setup.transforms.len() {
            current.viewport = extras.viewport as u8;
        }
    }

    pub(super) fn transform(&self, current: &Current) -> &'a Transform {
        &self.setup.transforms[usize::from(current.viewport)]
    }

    /// A shaded vertex as the primitive's viewport has it.
    #[inline(always)]
    fn vertex(&self, current: &Current, slot: u32) -> Vertex {
        let mut vertex = self.shaded.vertices[slot as usize];
        if current.viewport != 0 {
            let transform = self.transform(current);
            vertex.projected = transform.project(vertex.position);
            let kept = vertex.code & (code::INVALID | code::ANY_USER | code::ANY_CULL);
            vertex.code = kept | transform.code(vertex.position, &vertex.projected);
        }
        vertex
    }

    fn point(&mut self, current: &Current) {
        let slot = current.slots[0];
        let vertex = self.vertex(current, slot);
        if vertex.code & (code::CLIP | code::ANY_SIDE | code::ANY_CULL) != 0 {
            return;
        }
        self.out.clipped += 1;
        let place = Place {
            projected: vertex.projected,
            origin: Origin::Slot(slot),
        };
        self.push_point(current, &place, self.extras(slot).point_size, 0.0);
    }

    fn line(&mut self, current: &Current) {
        let slots = [current.slots[0], current.slots[1]];
        let ends = slots.map(|slot| self.vertex(current, slot));
        let (all, any) = (ends[0].code & ends[1].code, ends[0].code | ends[1].code);
        // A wide line may reach into the view volume from beyond its side.
        if all & code::OUTSIDE & !code::ANY_SIDE != 0 || any & code::INVALID != 0 {
            return;
        }
        let mut places = [0, 1].map(|end: usize| Place {
            projected: ends[end].projected,
            origin: Origin::Slot(slots[end]),
        });
        if any & code::CLIP != 0 {
            let clipper = self.clipper(current);
            let Some(clipped) = clipper.line([ends[0].position, ends[1].position]) else {
                return;
            };
            for (place, vertex) in places.iter_mut().zip(&clipped) {
                if vertex.corner().is_none() {
                    *place = self.new_place(current, vertex);
                }
            }
        }
        self.out.clipped += 1;
        self.push_line(current, &places[0], &places[1], 0.0);
    }

    fn clipper(&self, current: &Current) -> Clipper<'a> {
        let count = self.setup.outputs.clip.iter().rposition(Option::is_some);
        let distances = current.slots.map(|slot| self.extras(slot).clip);
        Clipper {
            transform: self.transform(current),
            distances,
            distance_count: count.map_or(0, |last| last + 1),
        }
    }

    fn triangle(&mut self, current: &mut Current) {
        let vertices = current.slots.map(|slot| self.vertex(current, slot));
        let [a, b, c] = [vertices[0].code, vertices[1].code, vertices[2].code];
        let (all, any) = (a & b & c, a | b | c);
        if all & code::OUTSIDE != 0 || any & code::INVALID != 0 {
            return;
        }
        if any & code::CLIP != 0 {
            self.clipped_triangle(current, &vertices);
            return;
        }
        self.out.clipped += 1;
        let projected = [0, 1, 2].map(|corner: usize| &vertices[corner].projected);
        let area = cross(projected.map(|projected| projected.snapped));
        if !self.faces(current, area) {
            return;
        }
        let state = self.setup.state;
        if state.polygon_mode == PolygonMode::Fill && area == 0 {
            return;
        }
        let places = [0, 1, 2].map(|corner: usize| Place {
            projected: vertices[corner].projected,
            origin: Origin::Slot(current.slots[corner]),
        });
        match state.polygon_mode {
            PolygonMode::Fill => {
                self.push_triangle(current, [&places[0], &places[1], &places[2]], area)
            }
            _ => self.outline(current, &places, &[true; 3]),
        }
    }

    fn clipped_triangle(&mut self, current: &mut Current, vertices: &[Vertex; 3]) {
        let clipper = self.clipper(current);
        let polygon = clipper.triangle([0, 1, 2].map(|corner: usize| vertices[corner].position));
        let clipped = polygon.vertices();
        if clipped.len() < 3 {
            return;
        }
        self.out.clipped += clipped.len() as u64 - 2;
        // Whether it is seen is decided before anything is made for it.
        let transform = self.transform(current);
        let snapped = |vertex: &ClipVertex| match vertex.corner() {
            Some(corner) => vertices[corner].projected.snapped,
            None => transform.project(narrow(vertex)).snapped,
        };
        let fan = |place: usize| [0, place, place + 1].map(|place| snapped(&clipped[place]));
        let area: i64 = (1..clipped.len() - 1).map(|place| cross(fan(place))).sum();
        let fills = self.setup.state.polygon_mode == PolygonMode::Fill;
        if !self.faces(current, area) || (fills && area == 0) {
            return;
        }
        let mut places = Vec::with_capacity(clipped.len());
        for vertex in clipped {
            places.push(match vertex.corner() {
                Some(corner) => Place {
                    projected: vertices[corner].projected,
                    origin: Origin::Slot(current.slots[corner]),
                },
                None => self.new_place(current, vertex),
            });
        }
        if !fills {
            let edges: Vec<bool> = clipped.iter().map(|vertex| vertex.edge).collect();
            self.outline(current, &places, &edges);
            return;
        }
        for pair in places[1..].windows(2) {
            let corners = [&places[0], &pair[0], &pair[1]];
            let part = cross(corners.map(|place| place.projected.snapped));
            // What snapping has turned over lies within its neighbours.
            if part.signum() == area.signum() {
                self.push_triangle(current, corners, part);
            }
        }
    }

    /// Finds out which way a polygon of that area faces, and whether such polygons are drawn. y points down, so that
    /// a positive area is clockwise. One without area faces the back.
    fn faces(&self, current: &mut Current, area: i64) -> bool {
        let state = self.setup.state;
        current.front = area != 0 && (area > 0) == state.front_clockwise;
        !if current.front {
            state.cull_front
        } else {
            state.cull_back
        }
    }

    /// Draws a polygon's edges or vertices.
    fn outline(&mut self, current: &Current, places: &[Place], edges: &[bool]) {
        let bias = self.bias([&places[0], &places[1], &places[2]]);
        let next = |place: usize| (place + 1) % places.len();
        for place in (0..places.len()).filter(|&place| edges[place]) {
            if self.setup.state.polygon_mode == PolygonMode::Line {
                self.push_line(current, &places[place], &places[next(place)], bias);
            } else {
                let size = match places[place].origin {
                    Origin::Slot(slot) => self.extras(slot).point_size,
                    Origin::New { .. } => self.extras(current.provoking).point_size,
                };
                self.push_point(current, &places[place], size, bias);
            }
        }
    }

    pub(super) fn bias(&self, corners: [&Place; 3]) -> f32 {
        match &self.setup.state.depth_bias {
            Some(bias) => {
                let corners = corners.map(|place| &place.projected);
                depth_bias::bias(bias, self.setup.depth_unit, corners)
            }
            None => 0.0,
        }
    }
}

/// A position as vertices have it.
pub(super) fn narrow(vertex: &ClipVertex) -> [f32; 4] {
    vertex.position.map(|coordinate| coordinate as f32)
}

/// Twice the signed area of a triangle.
#[inline(always)]
pub(super) fn cross([a, b, c]: [[i32; 2]; 3]) -> i64 {
    let along = |to: [i32; 2], axis: usize| i64::from(to[axis]) - i64::from(a[axis]);
    along(b, 0) * along(c, 1) - along(b, 1) * along(c, 0)
}
