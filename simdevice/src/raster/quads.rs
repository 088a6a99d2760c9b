//! Where fragments lie in the planes of tile buffers.

use super::tile::AREA;

/// Where the quads of 16 lanes are in a plane: texels, from its beginning.
#[derive(Clone, Copy, Debug)]
pub struct Quads {
    pub first: [usize; 4],
    /// Whether they follow one another.
    pub consecutive: bool,
}

impl Quads {
    /// Those of a block, from a texel on.
    #[inline(always)]
    pub fn block(first: usize) -> Self {
        Self {
            first: [first, first + 4, first + 8, first + 12],
            consecutive: true,
        }
    }

    /// The texel of a lane.
    #[inline(always)]
    pub fn texel(&self, lane: usize) -> usize {
        self.first[lane / 4] + lane % 4
    }

    /// The tiles that they are in, of a plane of `samples` samples a pixel.
    #[inline(always)]
    pub fn tiles(&self, samples: usize) -> [usize; 4] {
        // A power of two.
        let shift = (samples * AREA).trailing_zeros();
        let [a, b, c, d] = self.first;
        [a >> shift, b >> shift, c >> shift, d >> shift]
    }

    /// The words of 16 lanes' texels of a word each.
    #[inline(always)]
    pub fn load(&self, words: &[u32]) -> [u32; 16] {
        let mut out = [0; 16];
        if self.consecutive {
            out.copy_from_slice(&words[self.first[0]..][..16]);
        } else {
            for (quad, out) in self.first.iter().zip(out.chunks_exact_mut(4)) {
                out.copy_from_slice(&words[*quad..][..4]);
            }
        }
        out
    }

    /// Sets the texels of some lanes.
    #[inline(always)]
    pub fn store(&self, words: &mut [u32], lanes: u16, values: &[u32; 16]) {
        if self.consecutive && lanes == u16::MAX {
            words[self.first[0]..][..16].copy_from_slice(values);
            return;
        }
        for (quad, first) in self.first.iter().enumerate() {
            let values = &values[4 * quad..][..4];
            match lanes >> (4 * quad) & 15 {
                0 => {}
                15 => words[*first..][..4].copy_from_slice(values),
                some => {
                    // Another quad of the vector may be at the same place with other lanes.
                    let texels = &mut words[*first..][..4];
                    let mask = &QUAD_MASKS[usize::from(some)];
                    for lane in 0..4 {
                        texels[lane] = values[lane] & mask[lane] | texels[lane] & !mask[lane];
                    }
                }
            }
        }
    }
}

/// For each set of lanes of a quad: all ones in those.
const QUAD_MASKS: [[u32; 4]; 16] = {
    let mut masks = [[0; 4]; 16];
    let mut set = 0;
    while set < 16 {
        let mut lane = 0;
        while lane < 4 {
            if set >> lane & 1 == 1 {
                masks[set][lane] = u32::MAX;
            }
            lane += 1;
        }
        set += 1;
    }
    masks
};
