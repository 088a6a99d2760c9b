//! The specification's decoding of a single texel, step by step and without tables: what the decoder is compared with.

use super::Texel;

/// A texel: the components of 16 bits, or the error colour.
pub(super) type Result = std::result::Result<Texel, &'static str>;

/// Bits `low` to `high` of a number.
fn b(number: u128, high: u32, low: u32) -> i64 {
    (low..=high).map(|at| ((number >> at & 1) as i64) << (at - low)).sum()
}

/// The trits, quints and bits of a range.
type Form = (bool, bool, u32);

/// The bits that integers of a range take, as in "Data Size Determination".
fn size((trit, quint, bits): Form, count: u32) -> u32 {
    let ceiling = |numerator: u32, denominator: u32| numerator.div_ceil(denominator);
    u32::from(trit) * ceiling(count * 8, 5) + u32::from(quint) * ceiling(count * 7, 3) + count * bits
}

/// Integer `index` of a sequence: its digit and its bits. Bits from `end` on are zero.
fn integer(sequence: u128, end: u32, (trit, quint, n): Form, index: u32) -> (i64, i64) {
    let sequence = sequence & ((1 << end) - 1);
    if trit {
        let block = sequence >> (index / 5 * (8 + 5 * n));
        // The bits of the code, with the number of integers whose own bits lie below each.
        let code = [(0, 1), (1, 1), (2, 2), (3, 2), (4, 3), (5, 4), (6, 4), (7, 5)];
        let t: u128 = code.iter().map(|&(bit, below)| (block >> (bit + below * n) & 1) << bit).sum();
        let (c, t3, t4) = if b(t, 4, 2) == 7 {
            (b(t, 7, 5) << 2 | b(t, 1, 0), 2, 2)
        } else if b(t, 6, 5) == 3 {
            (b(t, 4, 0), b(t, 7, 7), 2)
        } else {
            (b(t, 4, 0), b(t, 6, 5), b(t, 7, 7))
        };
        let c = c as u128;
        let (t0, t1, t2) = if b(c, 1, 0) == 3 {
            (b(c, 3, 3) << 1 | b(c, 2, 2) & !b(c, 3, 3), b(c, 4, 4), 2)
        } else if b(c, 3, 2) == 3 {
            (b(c, 1, 0), 2, 2)
        } else {
            (b(c, 1, 1) << 1 | b(c, 0, 0) & !b(c, 1, 1), b(c, 3, 2), b(c, 4, 4))
        };
        let own = [0, n + 2, 2 * n + 4, 3 * n + 5, 4 * n + 7][index as usize % 5];
        ([t0, t1, t2, t3, t4][index as usize % 5], (block >> own & ((1 << n) - 1)) as i64)
    } else if quint {
        let block = sequence >> (index / 3 * (7 + 3 * n));
        let code = [(0, 1), (1, 1), (2, 1), (3, 2), (4, 2), (5, 3), (6, 3)];
        let q: u128 = code.iter().map(|&(bit, below)| (block >> (bit + below * n) & 1) << bit).sum();
        let digits = if b(q, 2, 1) == 3 && b(q, 6, 5) == 0 {
            let q0 = b(q, 0, 0);
            [4, 4, q0 << 2 | (b(q, 4, 4) & !q0) << 1 | b(q, 3, 3) & !q0]
        } else {
            let (c, q2) = if b(q, 2, 1) == 3 {
                (b(q, 4, 3) << 3 | (3 - b(q, 6, 5)) << 1 | b(q, 0, 0), 4)
            } else {
                (b(q, 4, 0), b(q, 6, 5))
            };
            let c = c as u128;
            if b(c, 2, 0) == 5 { [b(c, 4, 3), 4, q2] } else { [b(c, 2, 0), b(c, 4, 3), q2] }
        };
        let own = [0, n + 3, 2 * n + 5][index as usize % 3];
        (digits[index as usize % 3], (block >> own & ((1 << n) - 1)) as i64)
    } else {
        (0, (sequence >> (index * n) & ((1 << n) - 1)) as i64)
    }
}

/// `bits` bits repeated from the most significant bit down, until there are `wanted`.
fn replicated(value: i64, bits: u32, wanted: u32) -> i64 {
    (0..wanted).fold(0, |all, at| all << 1 | value >> (bits - 1 - at % bits) & 1)
}

/// A number whose binary digits are letters of a layout: `a` is the least significant bit of `value`, and so on.
fn layout(letters: &str, value: i64) -> i64 {
    let bit = |letter: u8| if letter == b'0' { 0 } else { value >> (letter - b'a') & 1 };
    letters.bytes().fold(0, |all, letter| all << 1 | bit(letter))
}

/// "Endpoint Unquantization".
fn unquantized_color((trit, quint, n): Form, (digit, bits): (i64, i64)) -> i64 {
    if !trit && !quint {
        return replicated(bits, n, 8);
    }
    let (letters, c) = match (trit, n) {
        (true, 1) => ("000000000", 204),
        (false, 1) => ("000000000", 113),
        (true, 2) => ("b000b0bb0", 93),
        (false, 2) => ("b0000bb00", 54),
        (true, 3) => ("cb000cbcb", 44),
        (false, 3) => ("cb0000cbc", 26),
        (true, 4) => ("dcb000dcb", 22),
        (false, 4) => ("dcb0000dc", 13),
        (true, 5) => ("edcb000ed", 11),
        (false, 5) => ("edcb0000e", 6),
        _ => ("fedcb000f", 5),
    };
    let a = layout("aaaaaaaaa", bits);
    let mixed = (digit * c + layout(letters, bits)) ^ a;
    (a & 0x80) | (mixed >> 2)
}

/// "Weight Unquantization".
fn unquantized_weight((trit, quint, n): Form, (digit, bits): (i64, i64)) -> i64 {
    let unquantized = if !trit && !quint {
        replicated(bits, n, 6)
    } else if n == 0 {
        if trit { [0, 32, 63][digit as usize] } else { [0, 16, 32, 47, 63][digit as usize] }
    } else {
        let (letters, c) = match (trit, n) {
            (true, 1) => ("0000000", 50),
            (false, 1) => ("0000000", 28),
            (true, 2) => ("b000b0b", 23),
            (false, _) => ("b0000b0", 13),
            _ => ("cb000cb", 11),
        };
        let a = layout("aaaaaaa", bits);
        let mixed = (digit * c + layout(letters, bits)) ^ a;
        (a & 0x20) | (mixed >> 2)
    };
    unquantized + i64::from(unquantized > 32)
}

/// A row of "2D block mode layout": the width and height of the grid, the range's code, and the flags of dual planes and
/// of high precision.
fn block_mode(m: u128) -> Option<(i64, i64, i64, bool, bool)> {
    let flags = (b(m, 10, 10) == 1, b(m, 9, 9) == 1);
    let low = b(m, 4, 4) | b(m, 1, 0) << 1;
    let high = b(m, 4, 4) | b(m, 3, 2) << 1;
    let (width, height, code, (dual, precise)) = if b(m, 1, 0) != 0 {
        let (width, height) = match (b(m, 3, 2), b(m, 8, 8)) {
            (0, _) => (b(m, 8, 7) + 4, b(m, 6, 5) + 2),
            (1, _) => (b(m, 8, 7) + 8, b(m, 6, 5) + 2),
            (2, _) => (b(m, 6, 5) + 2, b(m, 8, 7) + 8),
            (_, 0) => (b(m, 6, 5) + 2, b(m, 7, 7) + 6),
            _ => (b(m, 7, 7) + 2, b(m, 6, 5) + 2),
        };
        (width, height, low, flags)
    } else {
        match (b(m, 8, 7), b(m, 6, 5)) {
            (0, height) => (12, height + 2, high, flags),
            (1, width) => (width + 2, 12, high, flags),
            (2, width) => (width + 6, b(m, 10, 9) + 6, high, (false, false)),
            (_, 0) => (6, 10, high, flags),
            (_, 1) => (10, 6, high, flags),
            _ => return None,
        }
    };
    (code >= 2).then_some((width, height, code, dual, precise))
}

/// "Partition Pattern Generation".
fn select_partition(seed: u32, [x, y]: [u32; 2], count: u32, small_block: bool) -> usize {
    let (x, y) = if small_block { (x << 1, y << 1) } else { (x, y) };
    let seed = seed + (count - 1) * 1024;
    let mut p = seed;
    p ^= p >> 15;
    p = p.wrapping_sub(p << 17);
    p = p.wrapping_add(p << 7);
    p = p.wrapping_add(p << 4);
    p ^= p >> 5;
    p = p.wrapping_add(p << 16);
    p ^= p >> 7;
    p ^= p >> 3;
    p ^= p << 6;
    p ^= p >> 17;
    let mut seeds: Vec<u32> = (0..8).map(|nibble| (p >> (4 * nibble) & 15).pow(2)).collect();
    let (mut sh1, mut sh2) = (if seed & 2 != 0 { 4 } else { 5 }, if count == 3 { 6 } else { 5 });
    if seed & 1 == 0 {
        std::mem::swap(&mut sh1, &mut sh2);
    }
    for (index, seed) in seeds.iter_mut().enumerate() {
        *seed >>= if index % 2 == 0 { sh1 } else { sh2 };
    }
    let number = |at: usize, shift: u32| (seeds[at] * x + seeds[at + 1] * y + (p >> shift)) & 0x3F;
    let (a, b) = (number(0, 14), number(2, 10));
    let c = if count < 3 { 0 } else { number(4, 6) };
    let d = if count < 4 { 0 } else { number(6, 2) };
    if a >= b && a >= c && a >= d {
        0
    } else if b >= c && b >= d {
        1
    } else if c >= d {
        2
    } else {
        3
    }
}

/// "LDR Endpoint Decoding"; `None` for modes of the HDR profile.
fn endpoints(mode: i64, v: &[i64]) -> Option<[[i64; 4]; 2]> {
    let mut v = v.to_vec();
    let mut transfer = |a: usize, b: usize| {
        v[b] = v[b] >> 1 | v[a] & 0x80;
        v[a] = v[a] >> 1 & 0x3F;
        if v[a] & 0x20 != 0 {
            v[a] -= 0x40;
        }
    };
    match mode {
        5 => [1, 3].into_iter().for_each(|at| transfer(at, at - 1)),
        9 => [1, 3, 5].into_iter().for_each(|at| transfer(at, at - 1)),
        13 => [1, 3, 5, 7].into_iter().for_each(|at| transfer(at, at - 1)),
        _ => {}
    }
    let contract = |[r, g, b, a]: [i64; 4]| [(r + b) >> 1, (g + b) >> 1, b, a];
    let ends = match mode {
        0 => [[v[0], v[0], v[0], 0xFF], [v[1], v[1], v[1], 0xFF]],
        1 => {
            let l0 = v[0] >> 2 | v[1] & 0xC0;
            let l1 = l0 + (v[1] & 0x3F);
            [[l0, l0, l0, 0xFF], [l1, l1, l1, 0xFF]]
        }
        4 => [[v[0], v[0], v[0], v[2]], [v[1], v[1], v[1], v[3]]],
        5 => [[v[0], v[0], v[0], v[2]], [v[0] + v[1], v[0] + v[1], v[0] + v[1], v[2] + v[3]]],
        6 => [[(v[0] * v[3]) >> 8, (v[1] * v[3]) >> 8, (v[2] * v[3]) >> 8, 0xFF], [v[0], v[1], v[2], 0xFF]],
        10 => [[(v[0] * v[3]) >> 8, (v[1] * v[3]) >> 8, (v[2] * v[3]) >> 8, v[4]], [v[0], v[1], v[2], v[5]]],
        8 | 12 => {
            let [a0, a1] = if mode == 8 { [0xFF; 2] } else { [v[6], v[7]] };
            if v[1] + v[3] + v[5] >= v[0] + v[2] + v[4] {
                [[v[0], v[2], v[4], a0], [v[1], v[3], v[5], a1]]
            } else {
                [contract([v[1], v[3], v[5], a1]), contract([v[0], v[2], v[4], a0])]
            }
        }
        9 | 13 => {
            let [a0, a1] = if mode == 9 { [0xFF; 2] } else { [v[6], v[6] + v[7]] };
            if v[1] + v[3] + v[5] >= 0 {
                [[v[0], v[2], v[4], a0], [v[0] + v[1], v[2] + v[3], v[4] + v[5], a1]]
            } else {
                [contract([v[0] + v[1], v[2] + v[3], v[4] + v[5], a1]), contract([v[0], v[2], v[4], a0])]
            }
        }
        _ => return None,
    };
    Some(ends.map(|end| end.map(|component| component.clamp(0, 255))))
}

/// Texel (x, y) of a block of `width` by `height` texels.
pub(super) fn texel(block: u128, [width, height]: [u32; 2], [x, y]: [u32; 2], is_srgb: bool) -> Result {
    if b(block, 8, 0) == 0b1_1111_1100 {
        let [min_s, max_s, min_t, max_t] = [b(block, 24, 12), b(block, 37, 25), b(block, 50, 38), b(block, 63, 51)];
        if b(block, 9, 9) == 1 {
            return Err("a colour of the HDR profile");
        }
        if b(block, 11, 10) != 3 {
            return Err("reserved bits");
        }
        if b(block, 63, 12) != (1 << 52) - 1 && (min_s >= max_s || min_t >= max_t) {
            return Err("an empty extent");
        }
        return Ok([79, 95, 111, 127].map(|high| b(block, high, high - 15) as u16));
    }
    let (columns, rows, code, dual, precise) = block_mode(block & 0x7FF).ok_or("a reserved block mode")?;
    let weights: Form = match (code, precise) {
        (2, false) => (false, false, 1),
        (3, false) => (true, false, 0),
        (4, false) => (false, false, 2),
        (5, false) => (false, true, 0),
        (6, false) => (true, false, 1),
        (7, false) => (false, false, 3),
        (2, _) => (false, true, 1),
        (3, _) => (true, false, 2),
        (4, _) => (false, false, 4),
        (5, _) => (false, true, 2),
        (6, _) => (true, false, 3),
        _ => (false, false, 5),
    };
    let partitions = b(block, 12, 11) as u32 + 1;
    if columns > i64::from(width) || rows > i64::from(height) {
        return Err("a grid larger than the block");
    }
    if dual && partitions == 4 {
        return Err("dual planes of four partitions");
    }
    let weight_count = (columns * rows) as u32 * (1 + u32::from(dual));
    let weight_bits = size(weights, weight_count);
    if weight_count > 64 || !(24..=96).contains(&weight_bits) {
        return Err("too few or too many weights");
    }
    // Color endpoint modes.
    let selector = if partitions == 1 { 0 } else { b(block, 24, 23) };
    let (begin, config_bits) = match (partitions, selector) {
        (1, _) => (17, 17),
        (_, 0) => (29, 29),
        _ => (29, 25 + 3 * partitions),
    };
    let mut below_weights = 128 - weight_bits;
    let modes: Vec<i64> = if partitions == 1 {
        vec![b(block, 16, 13)]
    } else if selector == 0 {
        vec![b(block, 28, 25); partitions as usize]
    } else {
        let extra = 3 * partitions - 4;
        below_weights -= extra;
        let high = b(block, below_weights + extra - 1, below_weights);
        let all = (b(block, 28, 25) | high << 4) as u128;
        let mode = |i: u32| {
            let class = selector - 1 + b(all, i, i);
            let low = partitions + 2 * i;
            4 * class + b(all, low + 1, low)
        };
        (0..partitions).map(mode).collect()
    };
    let counts: Vec<u32> = modes.iter().map(|mode| 2 * (*mode as u32 / 4 + 1)).collect();
    let count: u32 = counts.iter().sum();
    if count > 18 {
        return Err("more than 18 integers");
    }
    let remaining = 128 - i64::from(config_bits) - i64::from(weight_bits) - if dual { 2 } else { 0 };
    if remaining < i64::from((13 * count).div_ceil(5)) {
        return Err("too few bits for colours");
    }
    // The range of colours with the most values.
    let forms = (1..=8).flat_map(|n| [(false, false, n), (true, false, n), (false, true, n)]);
    let values = |(trit, quint, n): Form| {
        (if trit {
            3
        } else if quint {
            5
        } else {
            1
        }) << n
    };
    let colors = forms
        .filter(|&form| (6..=256).contains(&values(form)) && i64::from(size(form, count)) <= remaining)
        .max_by_key(|&form| values(form))
        .ok_or("no range for colours")?;
    // Endpoints.
    let partition = if partitions == 1 {
        0
    } else {
        select_partition(b(block, 22, 13) as u32, [x, y], partitions, width * height < 31)
    };
    let first: u32 = counts[..partition].iter().sum();
    let end = size(colors, count);
    let v: Vec<i64> = (first..first + counts[partition])
        .map(|index| unquantized_color(colors, integer(block >> begin, end, colors, index)))
        .collect();
    let [e0, e1] = endpoints(modes[partition], &v).ok_or("an endpoint mode of the HDR profile")?;
    // Weights.
    let scale = |extent: u32| i64::from((1024 + extent / 2) / (extent - 1));
    let gs = (scale(width) * i64::from(x) * (columns - 1) + 32) >> 6;
    let gt = (scale(height) * i64::from(y) * (rows - 1) + 32) >> 6;
    let (js, fs, jt, ft) = (gs >> 4, gs & 15, gt >> 4, gt & 15);
    let decode_weight = |plane: u32, index: i64, share: i64| {
        if share == 0 {
            return 0;
        }
        let index = if dual { 2 * index as u32 + plane } else { index as u32 };
        share * unquantized_weight(weights, integer(block.reverse_bits(), weight_bits, weights, index))
    };
    let weight = |plane: u32| {
        let v0 = js + jt * columns;
        let w11 = (fs * ft + 8) >> 4;
        let shares = [(0, 16 - fs - ft + w11), (1, fs - w11), (columns, ft - w11), (columns + 1, w11)];
        (shares.iter().map(|&(step, share)| decode_weight(plane, v0 + step, share)).sum::<i64>() + 8) >> 4
    };
    let second = if dual { b(block, below_weights - 1, below_weights - 2) } else { -1 };
    Ok(std::array::from_fn(|channel| {
        let i = weight(u32::from(channel as i64 == second));
        let [c0, c1] = [e0, e1].map(|end| end[channel] << 8 | if is_srgb { 0x80 } else { end[channel] });
        ((c0 * (64 - i) + c1 * i + 32) / 64) as u16
    }))
}
