//! The floating-point modes of an application's thread.

/// The control bits that flush denormal results, and denormal operands, to zero.
pub const FLUSH: u32 = 1 << 15 | 1 << 6;

/// The control bits of the modes that round down, up and towards zero.
pub const ROUNDING: [u32; 3] = [1 << 13, 2 << 13, 3 << 13];

/// Bits of the thread's control register that are set until this is dropped.
pub struct Control(u32);

impl Control {
    /// Sets bits of [`FLUSH`] and [`ROUNDING`].
    pub fn with(bits: u32) -> Self {
        let before = Self::read();
        Self::write(before | bits & (FLUSH | ROUNDING[2]));
        Self(before)
    }

    fn read() -> u32 {
        let mut control = 0u32;
        // SAFETY: the instruction stores the register to a variable of its size.
        unsafe {
            std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut control, options(nostack, preserves_flags));
        }
        control
    }

    fn write(control: u32) {
        // SAFETY: no exception is unmasked. Tests compute with floats in the device alone while they have this.
        unsafe {
            std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const control, options(nostack, preserves_flags));
        }
    }
}

impl Drop for Control {
    fn drop(&mut self) {
        Self::write(self.0);
    }
}
