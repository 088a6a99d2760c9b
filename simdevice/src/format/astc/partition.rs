//! Partitions: which texels of a block have the same endpoints. A hash of the partition index makes them.

/// The partitions of a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Partitions {
    /// For each partition, the steps along x and y, and the beginning, of a number modulo 64. A texel is of the first
    /// partition whose number is largest.
    planes: [[u32; 3]; 4],
    count: usize,
    /// Coordinates are doubled in small blocks.
    shift: u32,
}

impl Partitions {
    /// The partitions of a block of `extent` texels. There are 2 to 4.
    pub(super) fn new(index: u32, count: u32, extent: [u32; 2]) -> Self {
        let seed = index + (count - 1) * 1024;
        let number = hash(seed);
        let square = |low: u32| {
            let nibble = number >> low & 15;
            nibble * nibble
        };
        let shifts = {
            let first = if seed & 2 == 2 { 4 } else { 5 };
            let second = if count == 3 { 6 } else { 5 };
            if seed & 1 == 1 { [first, second] } else { [second, first] }
        };
        let planes = [14, 10, 6, 2].map(|shift| number >> shift);
        let planes = std::array::from_fn(|partition| {
            let low = 8 * partition as u32;
            [square(low) >> shifts[0], square(low + 4) >> shifts[1], planes[partition]]
        });
        Self { planes, count: count as usize, shift: u32::from(extent[0] * extent[1] < 31) }
    }

    /// The partition of texel (x, y).
    pub(super) fn at(&self, [x, y]: [u32; 2]) -> usize {
        let (x, y) = (x << self.shift, y << self.shift);
        let number = |[along, across, begin]: [u32; 3]| (along * x + across * y + begin) & 63;
        let mut largest = (0, number(self.planes[0]));
        for (partition, &plane) in self.planes[..self.count].iter().enumerate().skip(1) {
            let number = number(plane);
            if number > largest.1 {
                largest = (partition, number);
            }
        }
        largest.0
    }
}

/// A number of 32 bits that depends on all bits of another.
fn hash(number: u32) -> u32 {
    let mut p = number;
    p ^= p >> 15;
    p = p.wrapping_sub(p << 17);
    p = p.wrapping_add(p << 7);
    p = p.wrapping_add(p << 4);
    p ^= p >> 5;
    p = p.wrapping_add(p << 16);
    p ^= p >> 7;
    p ^= p >> 3;
    p ^= p << 6;
    p ^ p >> 17
}
