//! Depth and stencil tests (Vulkan 1.3, 27.10 to 27.14).
//!
//! Depths are compared in the encoding of the attachment, whose codes are ordered as the depths are (see
//! [`DepthEncoding`]).

use crate::format::Format;
use crate::format::depth::DepthEncoding;
use crate::state::{CompareOp, DepthStencil, StencilFace, StencilOp};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, mask32x16, u32x16};

/// The depth and stencil tests of a draw.
#[derive(Clone, Copy, Debug)]
pub struct Tests {
    pub code: DepthEncoding,
    /// The comparison, and true if depth is written.
    pub depth: Option<(CompareOp, bool)>,
    /// The least and the greatest stored depth of the depth-bounds test.
    pub bounds: Option<[u32; 2]>,
    /// The stencil state of front and of back faces.
    pub stencil: Option<[StencilFace; 2]>,
}

impl Tests {
    /// The tests of a state that have an effect with attachments of these formats.
    pub fn new(state: &DepthStencil, depth: Option<Format>, stencil: bool) -> Self {
        let code = depth.map_or(DepthEncoding::Float, DepthEncoding::of);
        Self {
            code,
            depth: state
                .depth
                .filter(|test| depth.is_some() && (test.write || test.compare != CompareOp::Always))
                .map(|test| (test.compare, test.write)),
            bounds: state
                .bounds
                .filter(|_| depth.is_some())
                .map(|(least, greatest)| [least, greatest].map(|depth| code.encode_one(depth))),
            stencil: state.stencil.filter(|_| stencil),
        }
    }

    /// The tests with another stencil reference, for both faces.
    pub fn with_stencil_reference(&self, reference: u8) -> Self {
        Self { stencil: self.stencil.map(|faces| faces.map(|face| StencilFace { reference, ..face })), ..*self }
    }

    /// True if there is any test.
    pub fn any(&self) -> bool {
        self.reads_depth() || self.stencil.is_some()
    }

    /// True if the depth attachment is needed.
    pub fn reads_depth(&self) -> bool {
        self.depth.is_some() || self.bounds.is_some()
    }

    /// True if an attachment may change.
    pub fn writes(&self) -> bool {
        self.depth.is_some_and(|(_, write)| write)
            || self.stencil.is_some_and(|faces| {
                faces
                    .iter()
                    .any(|face| face.write_mask != 0 && [face.fail, face.pass, face.depth_fail] != [StencilOp::Keep; 3])
            })
    }

    /// The test that can reject fragments before shading although shading may discard them; `None` if there is none.
    /// Stored depths then move in one direction only, so that a fragment that fails now would also fail later.
    pub fn filter(&self) -> Option<Self> {
        let (compare, _) = self.depth?;
        let monotonic = matches!(
            compare,
            CompareOp::Less | CompareOp::LessOrEqual | CompareOp::Greater | CompareOp::GreaterOrEqual
        );
        (monotonic && self.stencil.is_none()).then_some(Self { depth: Some((compare, false)), bounds: None, ..*self })
    }

    /// True if no fragment depth passes against any stored depth. Both are given as the least and the greatest.
    #[inline(always)]
    pub fn hides(&self, fragments: [u32; 2], stored: [u32; 2]) -> bool {
        match self.depth {
            Some((CompareOp::Less, _)) => fragments[0] >= stored[1],
            Some((CompareOp::LessOrEqual, _)) => fragments[0] > stored[1],
            Some((CompareOp::Greater, _)) => fragments[1] <= stored[0],
            Some((CompareOp::GreaterOrEqual, _)) => fragments[1] < stored[0],
            _ => false,
        }
    }

    /// Tests 16 samples that have stored `depths` and `stencils`, and returns the lanes of `lanes` that pass. Replaces
    /// `depths` and `stencils` by the values to store, in lanes of `lanes` only.
    #[inline(always)]
    pub fn test<S: Simd>(
        &self,
        simd: S,
        lanes: u16,
        front: bool,
        fragments: u32x16<S>,
        depths: &mut [u32; 16],
        stencils: &mut [u8; 16],
    ) -> u16 {
        let stored = u32x16::simd_from(simd, *depths);
        let mut lanes = lanes;
        if let Some([least, greatest]) = self.bounds {
            let inside = stored.simd_ge(least) & stored.simd_le(greatest);
            lanes &= inside.to_bitmask() as u16;
        }
        let stencil_passed = match &self.stencil {
            Some(faces) => test_stencil(&faces[usize::from(!front)], lanes, stencils),
            None => lanes,
        };
        let mut passed = stencil_passed;
        if let Some((compare, write)) = self.depth {
            let passes = compare_vectors(simd, compare, fragments, stored);
            passed &= passes.to_bitmask() as u16;
            if write {
                let written = mask32x16::from_bitmask(simd, passed.into());
                written.select(fragments, stored).store_slice(depths);
            }
        }
        if let Some(faces) = &self.stencil {
            let face = &faces[usize::from(!front)];
            update_stencil(face, lanes, stencil_passed, passed, stencils);
        }
        passed
    }
}

/// The lanes for which `fragment op stored` is true.
#[inline(always)]
fn compare_vectors<S: Simd>(simd: S, op: CompareOp, fragment: u32x16<S>, stored: u32x16<S>) -> mask32x16<S> {
    match op {
        CompareOp::Never => mask32x16::splat(simd, false),
        CompareOp::Less => fragment.simd_lt(stored),
        CompareOp::Equal => fragment.simd_eq(stored),
        CompareOp::LessOrEqual => fragment.simd_le(stored),
        CompareOp::Greater => fragment.simd_gt(stored),
        CompareOp::NotEqual => fragment.simd_ne(stored),
        CompareOp::GreaterOrEqual => fragment.simd_ge(stored),
        CompareOp::Always => mask32x16::splat(simd, true),
    }
}

/// The lanes that pass the stencil test.
fn test_stencil(face: &StencilFace, lanes: u16, stencils: &[u8; 16]) -> u16 {
    let reference = face.reference & face.compare_mask;
    let mut passed = 0;
    for (lane, stencil) in stencils.iter().enumerate() {
        let passes = face.compare.holds(reference, stencil & face.compare_mask);
        passed |= u16::from(passes) << lane;
    }
    passed & lanes
}

/// Applies the stencil operations that the tests' results select.
fn update_stencil(face: &StencilFace, lanes: u16, stencil_passed: u16, passed: u16, stencils: &mut [u8; 16]) {
    for (lane, stencil) in stencils.iter_mut().enumerate() {
        let is = |set: u16| set >> lane & 1 == 1;
        let op = if !is(lanes) {
            StencilOp::Keep
        } else if is(passed) {
            face.pass
        } else if is(stencil_passed) {
            face.depth_fail
        } else {
            face.fail
        };
        let value = apply(op, *stencil, face.reference);
        *stencil = *stencil & !face.write_mask | value & face.write_mask;
    }
}

/// The result of a stencil operation.
pub fn apply(op: StencilOp, stencil: u8, reference: u8) -> u8 {
    match op {
        StencilOp::Keep => stencil,
        StencilOp::Zero => 0,
        StencilOp::Replace => reference,
        StencilOp::IncrementAndClamp => stencil.saturating_add(1),
        StencilOp::DecrementAndClamp => stencil.saturating_sub(1),
        StencilOp::Invert => !stencil,
        StencilOp::IncrementAndWrap => stencil.wrapping_add(1),
        StencilOp::DecrementAndWrap => stencil.wrapping_sub(1),
    }
}

#[cfg(test)]
mod tests;
