//! Primitive set-up: clips and culls assembled primitives, and converts them to the rasterizer's form.

use super::assemble::corners;
use super::bins::{Grid, Pair};
use super::clip::{ClipVertex, Clipper, MOST_VERTICES};
use super::depth_bias::{self, DepthUnit};
use super::line::StyledLine;
use super::primitive::{Primitive, cross};
use super::primitive_list::ListedPrimitive;
use super::shade::{NO_OPTIONAL_OUTPUTS, OptionalOutputs, Shaded, Vertex};
use super::vertex_reuse::VertexReuse;
use super::viewport::{Transform, WindowVertex, code};
use crate::geometry::bins::{Pixels, bin};
use crate::geometry::primitive::PrimitiveKind;
use crate::geometry::viewport::{ONE, snap_away, snap_length};
use crate::limits::{MAX_LINE_WIDTH, MAX_POINT_SIZE};
use crate::program::interface::Interpolation;
use crate::program::outputs::VertexOutputs;
use crate::simd::{both, three};
use crate::state::{DrawState, LineMode, PolygonMode, Rect};
use devmem::host;

/// The result of a segment. Vertices and primitives are numbered from 0.
#[derive(Debug, Default)]
pub(super) struct Output {
    pub primitives: Vec<Primitive>,
    pub varyings: Vec<u32>,
    pub pairs: Vec<Pair>,
    /// The lines that are no plain rectangles.
    pub lines: Vec<StyledLine>,
    /// The number of vertices, even if they have no varyings.
    pub vertices: u32,
    /// The number of primitives that were assembled.
    pub assembled: u64,
    /// The number of primitives that clipping produced.
    pub clipped: u64,
}

impl Output {
    /// Removes the content of an earlier segment, but keeps the memory.
    pub(super) fn clear(&mut self) {
        self.primitives.clear();
        self.varyings.clear();
        self.pairs.clear();
        self.lines.clear();
        (self.vertices, self.assembled, self.clipped) = (0, 0, 0);
    }
}

/// The inputs of set-up that a whole draw shares.
pub(super) struct Setup<'a> {
    pub state: &'a DrawState,
    /// The outputs of the last program.
    pub outputs: &'a VertexOutputs,
    /// The number of corners of the primitives: 1 to 3.
    pub corners: usize,
    /// The transform of each viewport.
    pub transforms: &'a [Transform],
    /// The pixels that may be touched, by viewport.
    pub regions: &'a [Rect],
    pub grid: Grid,
    pub layers: u32,
    /// The layer to which everything is drawn, if the program does not choose it.
    pub view: Option<u32>,
    pub depth_unit: DepthUnit,
    /// True if a line may go on where the one before it ends.
    pub has_strips: bool,
}

/// A segment being set up.
pub(super) struct SegmentSetup<'a> {
    pub(super) setup: &'a Setup<'a>,
    pub(super) shaded: &'a Shaded,
    /// The number in the output of the vertex in each slot, or [`NONE`].
    pub(super) numbers: &'a mut Vec<u32>,
    pub(super) out: &'a mut Output,
    /// True if the line that is set up goes on where the one before it ends.
    continues: bool,
}

/// Marks a vertex that has no number yet.
pub(super) const NONE: u32 = u32::MAX;

/// A primitive during set-up.
#[derive(Clone, Copy)]
pub(super) struct AssembledPrimitive {
    pub id: u32,
    /// The slots of its corners.
    pub slots: [u32; 3],
    /// The slot of the provoking vertex.
    pub provoking: u32,
    pub viewport: u8,
    pub layer: u16,
    pub front: bool,
}

/// A vertex of a primitive after clipping.
#[derive(Clone, Copy)]
pub(super) struct CornerVertex<'p> {
    pub window_vertex: &'p WindowVertex,
    pub origin: Origin,
}

#[derive(Clone, Copy)]
pub(super) enum Origin {
    /// A shaded vertex, by slot.
    Slot(u32),
    /// A vertex that clipping made, with its number in the output.
    New { number: u32 },
}

impl<'a> SegmentSetup<'a> {
    /// The set-up of a segment. `out` must be empty.
    pub(super) fn new(
        setup: &'a Setup<'a>,
        shaded: &'a Shaded,
        numbers: &'a mut Vec<u32>,
        out: &'a mut Output,
    ) -> Self {
        numbers.clear();
        numbers.resize(shaded.vertices.len(), NONE);
        Self { setup, shaded, numbers, out, continues: false }
    }

    /// Sets up all primitives of a segment.
    pub(super) fn run(mut self, reuse: &VertexReuse) {
        let state = self.setup.state;
        let count = self.setup.corners;
        for piece in &reuse.pieces {
            for number in piece.first..piece.end {
                let found = corners(state.topology, state.provoking_last, number);
                let slots = three(found.places, |place| reuse.slot(piece, place));
                let mut primitive = AssembledPrimitive {
                    id: piece.primitives_before.wrapping_add(number),
                    slots,
                    provoking: slots[found.provoking],
                    viewport: 0,
                    layer: 0,
                    front: true,
                };
                self.choose_target(&mut primitive);
                if count == 2 {
                    self.continues = self.setup.has_strips && number > 0;
                }
                self.primitive(count, &mut primitive);
            }
            self.out.assembled += u64::from(piece.end - piece.first);
        }
    }

    /// Sets up listed primitives.
    pub(super) fn run_list<'p>(mut self, primitives: impl Iterator<Item = &'p ListedPrimitive>) {
        let names_primitives = self.setup.outputs.primitive_id.is_some();
        let mut end = NONE;
        for listed in primitives {
            let mut primitive = AssembledPrimitive {
                id: if names_primitives { self.optional(listed.provoking).primitive_id } else { listed.id },
                slots: listed.slots,
                provoking: listed.provoking,
                viewport: 0,
                layer: 0,
                front: true,
            };
            self.choose_target(&mut primitive);
            self.continues = self.setup.has_strips && listed.slots[0] == end;
            end = listed.slots[1];
            self.primitive(self.setup.corners, &mut primitive);
            self.out.assembled += 1;
        }
    }

    /// Sets up a primitive of `corners` corners.
    #[inline(always)]
    fn primitive(&mut self, corners: usize, primitive: &mut AssembledPrimitive) {
        match corners {
            1 => self.with_vertices(primitive, Self::point),
            2 => self.with_vertices(primitive, Self::line),
            _ => self.with_vertices(primitive, Self::triangle),
        }
    }

    pub(super) fn optional(&self, slot: u32) -> &OptionalOutputs {
        self.shaded.optional.get(slot as usize).unwrap_or(&NO_OPTIONAL_OUTPUTS)
    }

    /// Sets the layer and viewport of a primitive, which the provoking vertex selects. A layer that does not exist
    /// becomes the last one, and a viewport that does not exist the first. A view is drawn to its own layer.
    fn choose_target(&self, primitive: &mut AssembledPrimitive) {
        primitive.layer = self.setup.view.map_or(0, |view| view as u16);
        if self.shaded.optional.is_empty() {
            return;
        }
        let optional = self.optional(primitive.provoking);
        if self.setup.view.is_none() {
            let layer = optional.layer.min(self.setup.layers.saturating_sub(1));
            primitive.layer = layer.min(u16::MAX.into()) as u16;
        }
        if (optional.viewport as usize) < self.setup.transforms.len() {
            primitive.viewport = optional.viewport as u8;
        }
    }

    pub(super) fn transform(&self, primitive: &AssembledPrimitive) -> &'a Transform {
        &self.setup.transforms[usize::from(primitive.viewport)]
    }

    /// A shaded vertex with the projection of the primitive's viewport, which is not the first.
    fn projected_again(&self, primitive: &AssembledPrimitive, slot: u32) -> Vertex {
        let mut vertex = self.shaded.vertices[slot as usize];
        let transform = self.transform(primitive);
        vertex.window_vertex = transform.project(vertex.position);
        let kept = vertex.code & (code::INVALID | code::ANY_USER | code::ANY_CULL);
        vertex.code = kept | transform.code(vertex.position, &vertex.window_vertex);
        vertex
    }

    /// Calls `then` with the primitive's vertices, projected by its viewport. They are not copied, because most of the
    /// time of set-up is spent here.
    #[inline(always)]
    fn with_vertices<const N: usize>(
        &mut self,
        primitive: &mut AssembledPrimitive,
        then: impl FnOnce(&mut Self, &mut AssembledPrimitive, [&Vertex; N]),
    ) {
        let shaded = self.shaded;
        if primitive.viewport == 0 {
            let vertices = std::array::from_fn(|corner| &shaded.vertices[primitive.slots[corner] as usize]);
            then(self, primitive, vertices);
        } else {
            let vertices: [Vertex; N] =
                std::array::from_fn(|corner| self.projected_again(primitive, primitive.slots[corner]));
            then(self, primitive, vertices.each_ref());
        }
    }

    fn point(&mut self, primitive: &mut AssembledPrimitive, [vertex]: [&Vertex; 1]) {
        // A large point may extend into the view volume from outside of its sides.
        if vertex.code & (code::CLIP | code::ANY_CULL) != 0 {
            return;
        }
        self.out.clipped += 1;
        let slot = primitive.slots[0];
        let corner = CornerVertex { window_vertex: &vertex.window_vertex, origin: Origin::Slot(slot) };
        self.push_point(primitive, corner, self.optional(slot).point_size, 0.0);
    }

    fn line(&mut self, primitive: &mut AssembledPrimitive, ends: [&Vertex; 2]) {
        let (all, any) = (ends[0].code & ends[1].code, ends[0].code | ends[1].code);
        // A wide line may extend into the view volume from outside of its sides.
        if all & code::OUTSIDE & !code::ANY_SIDE != 0 || any & code::INVALID != 0 {
            return;
        }
        let mut projected = ends.map(|end| end.window_vertex);
        let mut origins = [0, 1].map(|end: usize| Origin::Slot(primitive.slots[end]));
        if any & code::CLIP != 0 {
            let clipper = self.clipper(primitive);
            let Some(clipped) = clipper.line(ends.map(|end| end.position)) else {
                return;
            };
            for (end, vertex) in clipped.iter().enumerate() {
                if vertex.corner().is_none() {
                    projected[end] = self.transform(primitive).project(narrow(vertex));
                    origins[end] = self.new_vertex(primitive, vertex);
                }
            }
        }
        self.out.clipped += 1;
        let [from, to] = [0, 1].map(|end: usize| CornerVertex { window_vertex: &projected[end], origin: origins[end] });
        self.push_line(primitive, from, to, 0.0);
    }

    fn clipper(&self, primitive: &AssembledPrimitive) -> Clipper<'a> {
        let count = self.setup.outputs.clip.iter().rposition(Option::is_some);
        let distances = primitive.slots.map(|slot| self.optional(slot).clip);
        Clipper { transform: self.transform(primitive), distances, distance_count: count.map_or(0, |last| last + 1) }
    }

    #[inline(always)]
    fn triangle(&mut self, primitive: &mut AssembledPrimitive, vertices: [&Vertex; 3]) {
        let [a, b, c] = three(vertices, |vertex| vertex.code);
        let (all, any) = (a & b & c, a | b | c);
        if all & code::OUTSIDE != 0 || any & code::INVALID != 0 {
            return;
        }
        if any & code::CLIP != 0 {
            self.clipped_triangle(primitive, vertices);
            return;
        }
        self.out.clipped += 1;
        let area = cross(three(vertices, |vertex| vertex.window_vertex.snapped));
        if !self.faces(primitive, area) {
            return;
        }
        let corner = |number: usize| CornerVertex {
            window_vertex: &vertices[number].window_vertex,
            origin: Origin::Slot(primitive.slots[number]),
        };
        let corners = [corner(0), corner(1), corner(2)];
        if self.setup.state.polygon_mode != PolygonMode::Fill {
            self.outline(primitive, &corners, |_| true);
        } else if area != 0 {
            self.push_triangle(primitive, corners, area);
        }
    }

    #[cold]
    fn clipped_triangle(&mut self, primitive: &mut AssembledPrimitive, vertices: [&Vertex; 3]) {
        let clipper = self.clipper(primitive);
        let polygon = clipper.triangle(vertices.map(|vertex| vertex.position));
        let clipped = polygon.vertices();
        if clipped.len() < 3 {
            return;
        }
        self.out.clipped += clipped.len() as u64 - 2;
        let transform = self.transform(primitive);
        let mut projected = [WindowVertex::default(); MOST_VERTICES];
        for (projected, vertex) in projected.iter_mut().zip(clipped) {
            *projected = match vertex.corner() {
                Some(corner) => vertices[corner].window_vertex,
                None => transform.project(narrow(vertex)),
            };
        }
        // Visibility is decided before vertices are made.
        let fan = |number: usize| cross([0, number, number + 1].map(|i: usize| projected[i].snapped));
        let area: i64 = (1..clipped.len() - 1).map(fan).sum();
        let fills = self.setup.state.polygon_mode == PolygonMode::Fill;
        if !self.faces(primitive, area) || (fills && area == 0) {
            return;
        }
        let mut corners =
            [CornerVertex { window_vertex: &projected[0], origin: Origin::Slot(primitive.slots[0]) }; MOST_VERTICES];
        for (number, vertex) in clipped.iter().enumerate() {
            corners[number] = CornerVertex {
                window_vertex: &projected[number],
                origin: match vertex.corner() {
                    Some(corner) => Origin::Slot(primitive.slots[corner]),
                    None => self.new_vertex(primitive, vertex),
                },
            };
        }
        let corners = &corners[..clipped.len()];
        if !fills {
            self.outline(primitive, corners, |number| clipped[number].edge);
            return;
        }
        for pair in corners[1..].windows(2) {
            let triangle = [corners[0], pair[0], pair[1]];
            let part = cross(triangle.map(|corner| corner.window_vertex.snapped));
            // A triangle of the fan that snapping has turned over lies within its neighbours.
            if part.signum() == area.signum() {
                self.push_triangle(primitive, triangle, part);
            }
        }
    }

    /// Sets the facing of a polygon of this area, and returns true if such polygons are drawn. y points down, so that a
    /// positive area is clockwise. A polygon without area faces the back.
    fn faces(&self, primitive: &mut AssembledPrimitive, area: i64) -> bool {
        let state = self.setup.state;
        primitive.front = area != 0 && (area > 0) == state.front_clockwise;
        !if primitive.front { state.cull_front } else { state.cull_back }
    }

    /// Draws the edges of a polygon that belong to its outline, or the first vertex of each.
    fn outline(&mut self, primitive: &AssembledPrimitive, corners: &[CornerVertex], edge: impl Fn(usize) -> bool) {
        let bias = self.bias([corners[0], corners[1], corners[2]]);
        // The pattern of stippled lines begins anew with each edge.
        self.continues = false;
        let next = |number: usize| (number + 1) % corners.len();
        for number in (0..corners.len()).filter(|&number| edge(number)) {
            if self.setup.state.polygon_mode == PolygonMode::Line {
                self.push_line(primitive, corners[number], corners[next(number)], bias);
            } else {
                let size = match corners[number].origin {
                    Origin::Slot(slot) => self.optional(slot).point_size,
                    Origin::New { .. } => self.optional(primitive.provoking).point_size,
                };
                self.push_point(primitive, corners[number], size, bias);
            }
        }
    }

    pub(super) fn bias(&self, corners: [CornerVertex; 3]) -> f32 {
        match &self.setup.state.depth_bias {
            Some(bias) => {
                let corners = corners.map(|corner| corner.window_vertex);
                depth_bias::bias(bias, self.setup.depth_unit, corners)
            }
            None => 0.0,
        }
    }
}

/// The position of a clipped vertex in binary32.
pub(super) fn narrow(vertex: &ClipVertex) -> [f32; 4] {
    vertex.position.map(|coordinate| coordinate as f32)
}

/// The offsets of vertices that snapping has not moved.
const UNMOVED: [[i16; 2]; 3] = [[0; 2]; 3];

/// The number of units of [`Primitive::offsets`] in a pixel.
const OFFSET_UNITS: f64 = 16_777_216.0;

/// The geometry of a primitive.
struct Shape {
    kind: PrimitiveKind,
    corners: [[i32; 2]; 3],
    /// The positions of the vertices relative to the corners: see [`Primitive::offsets`].
    offsets: [[i16; 2]; 3],
    /// The depth at the vertices.
    depth: [f32; 3],
    /// The pixels that it may cover.
    pixels: Pixels,
}

impl SegmentSetup<'_> {
    #[inline(always)]
    pub(super) fn push_triangle(&mut self, primitive: &AssembledPrimitive, vertices: [CornerVertex; 3], area: i64) {
        let [a, b, c] = vertices;
        let vertices = nearest_first(if area > 0 { [a, b, c] } else { [a, c, b] });
        let corners = three(vertices, |vertex| vertex.window_vertex.snapped);
        let Some(pixels) = self.pixels(primitive, &corners) else {
            return;
        };
        if self.setup.state.samples == 1 && covers_nothing(&corners, pixels) {
            return;
        }
        let bias = self.bias(vertices);
        let shape = Shape {
            kind: PrimitiveKind::Triangle,
            corners,
            offsets: offsets(vertices),
            depth: three(vertices, |vertex| vertex.window_vertex.depth + bias),
            pixels,
        };
        self.push(primitive, &shape, vertices);
    }

    pub(super) fn push_line(
        &mut self,
        primitive: &AssembledPrimitive,
        from: CornerVertex,
        to: CornerVertex,
        bias: f32,
    ) {
        let (a, b) = (from.window_vertex.window, to.window_vertex.window);
        let (dx, dy) = (a[0] - b[0], a[1] - b[1]);
        let length = (dx * dx + dy * dy).sqrt();
        if length.is_nan() || length <= 0.0 {
            return;
        }
        let state = self.setup.state;
        let mut width = state.line_width.clamp(0.0, MAX_LINE_WIDTH);
        if state.line_mode == LineMode::Bresenham {
            // A whole width, rounded.
            width = ((width + 0.5) as u32).max(1) as f32;
        }
        let scale = 0.5 * width / length;
        let side = [snap_length(-dy * scale), snap_length(dx * scale)];
        let (a, b) = (a.map(snap_away), b.map(snap_away));
        let corners =
            [[a[0] - side[0], a[1] - side[1]], [a[0] + side[0], a[1] + side[1]], [b[0] + side[0], b[1] + side[1]]];
        if cross(corners) <= 0 {
            return;
        }
        let is_plain = state.line_mode == LineMode::Rectangular && !state.stipples_lines;
        let mut line = None;
        if !is_plain {
            let stipple = state.stipples_lines.then_some(state.line_stipple);
            line = StyledLine::new([a, b], corners, state.line_mode, stipple, width);
            if line.is_none() {
                return;
            }
        }
        let [c0, c1, c2] = line.as_ref().map_or(corners, StyledLine::outline);
        if let Some(line) = line {
            // A line beyond the region has no primitive, but the pattern goes on behind it.
            let number = self.out.primitives.len() as u32;
            host::push(&mut self.out.lines, line.placed(number, self.continues));
        }
        let last = [c0[0] + c2[0] - c1[0], c0[1] + c2[1] - c1[1]];
        let Some(pixels) = self.pixels(primitive, &[c0, c1, c2, last]) else {
            return;
        };
        let vertices = [from, from, to];
        let shape = Shape {
            kind: if is_plain { PrimitiveKind::Line } else { PrimitiveKind::StyledLine },
            corners: [c0, c1, c2],
            offsets: UNMOVED,
            depth: vertices.map(|vertex| vertex.window_vertex.depth + bias),
            pixels,
        };
        self.push(primitive, &shape, vertices);
    }

    pub(super) fn push_point(&mut self, primitive: &AssembledPrimitive, vertex: CornerVertex, size: f32, bias: f32) {
        let size = if size.is_nan() { 1.0 } else { size.clamp(0.0, MAX_POINT_SIZE) };
        let side = snap_length(size);
        if side == 0 {
            return;
        }
        let [x, y] = vertex.window_vertex.window.map(|at| snap_away(at) - side / 2);
        let corners = [[x, y], [x + side, y], [x + side, y + side]];
        if let Some(pixels) = self.pixels(primitive, &corners) {
            let shape = Shape {
                kind: PrimitiveKind::Point,
                corners,
                offsets: UNMOVED,
                depth: [vertex.window_vertex.depth + bias; 3],
                pixels,
            };
            self.push(primitive, &shape, [vertex; 3]);
        }
    }

    /// The pixels that may have a sample within the bounds of these corners and may be touched; `None` if there are
    /// none.
    #[inline(always)]
    fn pixels(&self, primitive: &AssembledPrimitive, corners: &[[i32; 2]]) -> Option<Pixels> {
        // The least and the greatest coordinate of a sample within a pixel.
        let (low, high) = if self.setup.state.samples == 1 { (128, 128) } else { (32, 224) };
        let region = &self.setup.regions[usize::from(primitive.viewport)];
        let along = |axis: usize, start: i32, length: u32| {
            let (mut least, mut greatest) = (i32::MAX, i32::MIN);
            for corner in corners {
                least = least.min(corner[axis]);
                greatest = greatest.max(corner[axis]);
            }
            // Samples on right and bottom edges are not covered.
            let first = (least - high + ONE - 1) >> 8;
            let last = (greatest - 1 - low) >> 8;
            let end = i64::from(start) + i64::from(length) - 1;
            let last = i64::from(last).min(end);
            [first.max(start), last as i32]
        };
        let pixels = Pixels { x: along(0, region.x, region.width), y: along(1, region.y, region.height) };
        (pixels.x[0] <= pixels.x[1] && pixels.y[0] <= pixels.y[1]).then_some(pixels)
    }

    #[inline(always)]
    fn push(&mut self, primitive: &AssembledPrimitive, shape: &Shape, vertices: [CornerVertex; 3]) {
        let numbers = three(vertices, |vertex| self.number(vertex.origin));
        let provoking = self.number(Origin::Slot(primitive.provoking));
        let primitive = Primitive {
            corners: shape.corners,
            offsets: shape.offsets,
            depth: shape.depth,
            inverse_w: three(vertices, |vertex| vertex.window_vertex.inverse_w),
            vertices: numbers,
            provoking,
            id: primitive.id,
            kind: shape.kind,
            front: primitive.front,
            viewport: primitive.viewport,
            layer: primitive.layer,
        };
        let number = self.out.primitives.len() as u32;
        bin(&self.setup.grid, &primitive, number, shape.pixels, &mut self.out.pairs);
        host::push(&mut self.out.primitives, primitive);
    }

    /// The number of a vertex in the output. A vertex is added at its first use.
    #[inline(always)]
    fn number(&mut self, origin: Origin) -> u32 {
        let slot = match origin {
            Origin::Slot(slot) => slot as usize,
            Origin::New { number } => return number,
        };
        if self.numbers[slot] == NONE {
            self.numbers[slot] = self.out.vertices;
            self.out.vertices += 1;
            let read = self.setup.outputs.interpolation.len();
            let varyings = &self.shaded.varyings[slot * self.shaded.per_vertex..][..read];
            host::extend(&mut self.out.varyings, varyings);
        }
        self.numbers[slot]
    }

    /// Adds a vertex that clipping made, with its interpolated varyings, to the output.
    pub(super) fn new_vertex(&mut self, primitive: &AssembledPrimitive, vertex: &ClipVertex) -> Origin {
        let number = self.out.vertices;
        self.out.vertices += 1;
        let weights = vertex.weights;
        // Weights in the framebuffer are those in clip space times w, normalized to a sum of 1.
        let mut linear = weights;
        for (weight, slot) in linear.iter_mut().zip(primitive.slots) {
            *weight *= f64::from(self.shaded.vertices[slot as usize].position[3]);
        }
        let sum: f64 = linear.iter().sum();
        let linear = linear.map(|weight| weight / sum);
        let interpolation = &self.setup.outputs.interpolation;
        let of = |slot: u32, varying: usize| self.shaded.values().vertex(slot)[varying];
        for (varying, interpolation) in interpolation.iter().enumerate() {
            let mix = |weights: [f64; 3]| {
                let part = |corner: usize| {
                    // An infinite value at a corner of weight zero must not make the sum NaN.
                    if weights[corner] == 0.0 {
                        return 0.0;
                    }
                    let value = f32::from_bits(of(primitive.slots[corner], varying));
                    weights[corner] * f64::from(value)
                };
                ((part(0) + part(1) + part(2)) as f32).to_bits()
            };
            let value = match interpolation {
                Interpolation::Perspective => mix(weights),
                Interpolation::Linear => mix(linear),
                Interpolation::Flat => of(primitive.provoking, varying),
            };
            host::push(&mut self.out.varyings, value);
        }
        Origin::New { number }
    }
}

/// The vertices rotated so that none is nearer than the first. Interpolation adds differences to the first vertex's
/// value. A far vertex may have so large a value that the sum would lose precision near the eye.
#[inline(always)]
fn nearest_first([a, b, c]: [CornerVertex<'_>; 3]) -> [CornerVertex<'_>; 3] {
    let [wa, wb, wc] = three([a, b, c], |vertex| vertex.window_vertex.inverse_w);
    if wb > wa && wb >= wc {
        [b, c, a]
    } else if wc > wa && wc > wb {
        [c, a, b]
    } else {
        [a, b, c]
    }
}

/// The positions of a triangle's vertices before snapping, relative to its corners.
#[inline(always)]
fn offsets(vertices: [CornerVertex; 3]) -> [[i16; 2]; 3] {
    let mut offsets = UNMOVED;
    for (offset, vertex) in offsets.iter_mut().zip(vertices) {
        let WindowVertex { window, snapped, .. } = vertex.window_vertex;
        for axis in 0..2 {
            let off = f64::from(window[axis]) - f64::from(snapped[axis]) / f64::from(ONE);
            offset[axis] = (off * OFFSET_UNITS) as i16;
        }
    }
    offsets
}

/// True if a triangle whose bounds hold at most four pixel centres covers none of them. Always false for larger
/// triangles, which are not tested.
#[inline(always)]
fn covers_nothing(corners: &[[i32; 2]; 3], pixels: Pixels) -> bool {
    let span = |[first, last]: [i32; 2]| last - first;
    if span(pixels.x) > 1 || span(pixels.y) > 1 {
        return false;
    }
    let inside = |x: i32, y: i32| {
        let [x, y] = both([x, y], |pixel| i64::from(pixel) * 256 + 128);
        let mut inside = true;
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let [[ax, ay], [bx, by]] = both([corners[from], corners[to]], |corner| both(corner, i64::from));
            let (dx, dy) = (bx - ax, by - ay);
            let value = dx * (y - ay) - dy * (x - ax);
            // Points on an edge belong to it if it is a left or a top one.
            let owns = dy < 0 || (dy == 0 && dx > 0);
            inside &= value > 0 || (value == 0 && owns);
        }
        inside
    };
    for y in pixels.y[0]..=pixels.y[1] {
        for x in pixels.x[0]..=pixels.x[1] {
            if inside(x, y) {
                return false;
            }
        }
    }
    true
}
