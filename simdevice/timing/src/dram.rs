//! A DRAM of channels, banks and rows, with the timings of LPDDR5. It answers requests of one burst each in the order
//! in which they come, and is exact for that: streams of requests have closed forms, which its tests hold it to.
//!
//! A bank has one open row. A burst of the open row takes the data bus for its length. Another row must be closed and
//! the new one opened first: precharge and activation of a bank overlap the bursts of others. Refreshes are left out;
//! a bank's take 3 to 4 % of the time ([`Timings::LPDDR5`] has the source).

use serde::{Deserialize, Serialize};

/// The shape and the timings of a DRAM.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Timings {
    /// Channels, each with a data bus of its own. Consecutive bursts go to consecutive channels.
    pub channels: u32,
    /// Banks of a channel.
    pub banks: u32,
    /// Bytes of a bank's row.
    pub row_bytes: u32,
    /// Bytes of a burst.
    pub burst_bytes: u32,
    /// Nanoseconds in which a burst takes the data bus.
    pub burst_ns: f64,
    /// Nanoseconds from a read of an open row to its data.
    pub read_ns: f64,
    /// Nanoseconds from the activation of a row until it can be read (tRCD).
    pub activate_ns: f64,
    /// Nanoseconds to close a row (tRP).
    pub precharge_ns: f64,
    /// Nanoseconds from a row's activation until it may be closed (tRAS).
    pub open_ns: f64,
}

impl Timings {
    /// LPDDR5 at 2133 MHz (4267 MT/s), 128 bits: eight channels of 16 bits, bursts of 16, 16 banks, rows of 2 kB, tRCD
    /// and tRP 18 ns, tRAS 42 ns, a read latency of 25 ns. The standard, JESD209-5, was not read. Ramulator 2
    /// (`src/dram/impl/LPDDR5.cpp`, 0b89cad) has the same shape, and 15, 15, 34 and 20 cycles of 1.25 ns at 6400 MT/s.
    /// It refreshes a bank in 120 to 140 ns (8 and 16 Gb), once in 3906 ns.
    pub const LPDDR5: Self = Self {
        channels: 8,
        banks: 16,
        row_bytes: 2048,
        burst_bytes: 32,
        burst_ns: 32.0 / (2.0 * 4.267),
        read_ns: 25.0,
        activate_ns: 18.0,
        precharge_ns: 18.0,
        open_ns: 42.0,
    };

    /// Nanoseconds from one activation of a bank to the next, at least (tRC).
    pub fn row_cycle_ns(&self) -> f64 {
        self.open_ns + self.precharge_ns
    }

    /// GB/s of all data buses.
    pub fn peak_gb_s(&self) -> f64 {
        f64::from(self.channels) * f64::from(self.burst_bytes) / self.burst_ns
    }

    /// Bursts of a row.
    fn row_bursts(&self) -> u64 {
        u64::from(self.row_bytes / self.burst_bytes)
    }
}

/// The state of a bank.
#[derive(Clone, Copy, Debug, Default)]
struct Bank {
    row: Option<u64>,
    /// The time of the last activation.
    activated_ns: f64,
    /// The end of its last burst.
    end_ns: f64,
}

/// A channel: its banks and the time at which its data bus is free.
#[derive(Clone, Debug)]
struct Channel {
    banks: Vec<Bank>,
    bus_ns: f64,
}

/// A DRAM with open rows.
#[derive(Clone, Debug)]
pub struct Dram {
    timings: Timings,
    channels: Vec<Channel>,
    /// Bursts that were answered.
    pub bursts: u64,
    /// The part of `bursts` that found their row open.
    pub hits: u64,
}

/// The place of a burst. From the lowest bits on, an address has the channel, the burst in the row, the bank and the
/// row, so that a sequence of addresses opens the same row of all channels, then that of the next bank.
struct Place {
    channel: usize,
    bank: usize,
    row: u64,
}

impl Place {
    fn of(address: u64, timings: &Timings) -> Self {
        let burst = address / u64::from(timings.burst_bytes);
        let (channel, burst) = (burst % u64::from(timings.channels), burst / u64::from(timings.channels));
        let row = burst / timings.row_bursts();
        let (bank, row) = (row % u64::from(timings.banks), row / u64::from(timings.banks));
        Self { channel: channel as usize, bank: bank as usize, row }
    }
}

impl Dram {
    /// A DRAM whose rows are closed.
    pub fn new(timings: Timings) -> Self {
        let channel = Channel { banks: vec![Bank::default(); timings.banks as usize], bus_ns: 0.0 };
        Self { timings, channels: vec![channel; timings.channels as usize], bursts: 0, hits: 0 }
    }

    /// Reads the burst at an address that is asked for at a time. Returns the time at which its last byte has come.
    pub fn read(&mut self, address: u64, asked_ns: f64) -> f64 {
        let timings = self.timings;
        let place = Place::of(address, &timings);
        let channel = &mut self.channels[place.channel];
        let bank = &mut channel.banks[place.bank];
        let mut ready_ns = asked_ns;
        if bank.row == Some(place.row) {
            self.hits += 1;
            // Reads of an open row are pipelined behind its activation.
            ready_ns = ready_ns.max(bank.activated_ns + timings.activate_ns);
        } else {
            if bank.row.is_some() {
                let closed_from = (bank.activated_ns + timings.open_ns).max(bank.end_ns - timings.read_ns);
                ready_ns = ready_ns.max(closed_from) + timings.precharge_ns;
            }
            bank.row = Some(place.row);
            bank.activated_ns = ready_ns;
            ready_ns += timings.activate_ns;
        }
        let begin_ns = (ready_ns + timings.read_ns).max(channel.bus_ns);
        bank.end_ns = begin_ns + timings.burst_ns;
        channel.bus_ns = bank.end_ns;
        self.bursts += 1;
        bank.end_ns
    }

    /// GB/s of `streams` modules' lists, each read from its beginning in pieces of `piece` bytes that come in turns: a
    /// module asks for a batch when it has room for one. Lists lie a megabyte and a row apart, so that they begin in
    /// different banks.
    pub fn lists_gb_s(timings: Timings, streams: u32, piece: u64) -> f64 {
        const ROUNDS: u64 = 256;
        let apart = (1 << 20) + u64::from(timings.row_bytes * timings.channels);
        let burst = u64::from(timings.burst_bytes);
        let mut dram = Self::new(timings);
        let bursts = piece.div_ceil(burst);
        let of = |round: u64, stream: u32| {
            let first = u64::from(stream) * apart + round * bursts * burst;
            (0..bursts).map(move |index| first + index * burst)
        };
        let rounds = (0..ROUNDS).flat_map(|round| (0..streams).flat_map(move |stream| of(round, stream)));
        let ns = dram.stream(rounds);
        dram.bursts as f64 * burst as f64 / ns
    }

    /// Reads bursts that are all asked for at time 0, and returns the time at which the last byte has come.
    pub fn stream(&mut self, addresses: impl IntoIterator<Item = u64>) -> f64 {
        addresses.into_iter().map(|address| self.read(address, 0.0)).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: Timings = Timings::LPDDR5;

    /// The time of a stream, in ns.
    fn time(addresses: impl IntoIterator<Item = u64>) -> f64 {
        Dram::new(T).stream(addresses)
    }

    /// The time of the first burst.
    fn first_ns() -> f64 {
        T.activate_ns + T.read_ns + T.burst_ns
    }

    #[test]
    fn the_peak_is_that_of_the_data_sheet() {
        assert!((T.peak_gb_s() - 68.3).abs() < 0.1, "{}", T.peak_gb_s());
    }

    #[test]
    fn a_sequence_of_addresses_takes_the_bus_all_the_time() {
        // A row of each channel has 64 bursts of 3.75 ns, and the next bank opens meanwhile.
        let count = 100_000_u64;
        let burst = u64::from(T.burst_bytes);
        let mut dram = Dram::new(T);
        let time = dram.stream((0..count).map(|k| k * burst));
        let each = count.div_ceil(T.channels.into());
        let expected = first_ns() + (each - 1) as f64 * T.burst_ns;
        assert!((time / expected - 1.0).abs() < 1e-9, "{time} {expected}");
        let rows =
            count.div_ceil(u64::from(T.channels) * u64::from(T.row_bytes / T.burst_bytes)) * u64::from(T.channels);
        assert!(dram.bursts - dram.hits <= rows, "a miss for each row");
    }

    #[test]
    fn lists_of_many_modules_come_near_the_peak() {
        let peak = T.peak_gb_s();
        let one = Dram::lists_gb_s(T, 1, 1280);
        let all = Dram::lists_gb_s(T, 15, 1280);
        assert!(one > 0.95 * peak && one <= peak, "{one}");
        assert!(all > 0.5 * peak && all <= one, "{all}");
    }

    #[test]
    fn a_stride_of_a_banks_rows_takes_a_row_cycle_each() {
        // Every address is in another row of one bank.
        let stride = u64::from(T.channels) * u64::from(T.row_bytes) * u64::from(T.banks);
        let count = 1000;
        let time = time((0..count).map(|k| k * stride));
        let expected = first_ns() + (count - 1) as f64 * T.row_cycle_ns();
        assert!((time / expected - 1.0).abs() < 1e-9, "{time} {expected}");
    }

    #[test]
    fn a_stride_of_a_row_is_limited_by_the_row_cycles_of_all_banks() {
        // Each address is in the next bank of one channel: of 16 banks, each has a row cycle for a burst.
        let stride = u64::from(T.channels) * u64::from(T.row_bytes);
        let count = 16_000_u64;
        let time = time((0..count).map(|k| k * stride));
        let banks = u64::from(T.banks);
        // The bus takes 16 bursts in the 60 ns of a row cycle: exactly as long, so that neither waits for long.
        let each = (T.row_cycle_ns() / banks as f64).max(T.burst_ns);
        let expected = first_ns() + (count - 1) as f64 * each;
        assert!((time / expected - 1.0).abs() < 0.01, "{time} {expected}");
    }

    #[test]
    fn a_stride_of_a_burst_of_each_channel_stays_in_open_rows() {
        // One channel of eight works: an eighth of the peak.
        let stride = u64::from(T.channels) * u64::from(T.burst_bytes);
        let count = 10_000_u64;
        let mut dram = Dram::new(T);
        let time = dram.stream((0..count).map(|k| k * stride));
        let expected = first_ns() + (count - 1) as f64 * T.burst_ns;
        assert!((time / expected - 1.0).abs() < 1e-9, "{time} {expected}");
        assert_eq!(dram.bursts - dram.hits, count.div_ceil(64));
    }

    #[test]
    fn random_rows_of_one_bank_hit_as_chance_says() {
        // Of two rows in one bank, the open one is met half of the time; a miss takes a row cycle, and a hit behind it
        // takes the bus.
        let rows = [0, u64::from(T.channels) * u64::from(T.row_bytes) * u64::from(T.banks)];
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            state >> 33
        };
        let mut dram = Dram::new(T);
        let count = 20_000;
        let addresses: Vec<_> = (0..count).map(|_| rows[(random() & 1) as usize]).collect();
        let changes = addresses.windows(2).filter(|pair| pair[0] != pair[1]).count() as f64;
        let time = dram.stream(addresses);
        assert_eq!(dram.bursts - dram.hits, changes as u64 + 1);
        assert!((changes / f64::from(count) - 0.5).abs() < 0.02, "{changes}");
        // A run of n hits ends at the later of the row's least open time and its last burst.
        let expected = changes * T.row_cycle_ns();
        assert!(time > expected && time < 1.1 * expected, "{time} {expected}");
    }

    #[test]
    fn random_bursts_of_all_memory_are_limited_by_the_fullest_of_few_banks() {
        // In order of their coming, a channel has one bank at work after the other; random banks overlap as far as the
        // requests in order let them: every request of a channel is asked for at once, so each bank's queue decides.
        let mut state = 7_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            state >> 20
        };
        let count = 64_000_u64;
        let addresses: Vec<_> = (0..count).map(|_| random() % (1 << 31) / 32 * 32).collect();
        let time = time(addresses);
        let least = count as f64 / f64::from(T.channels) / f64::from(T.banks) * T.row_cycle_ns();
        let alone = count as f64 / f64::from(T.channels) * T.row_cycle_ns();
        assert!(time > least && time < 0.5 * alone, "{time}, between {least} and {alone}");
    }
}
