//! How a thread rounds: applications may flush denormals to zero or round upwards in theirs, which is no business of the
//! driver. Each entry point computes as Rust and Vulkan assume, and so do the threads that it starts, which begin with
//! what the thread that starts them has; on return the application finds what it had set.

/// Rounding as usual, until it is dropped.
pub(crate) struct FloatControl(Option<register::Bits>);

impl FloatControl {
    /// Makes the thread round to nearest and keep denormals.
    pub(crate) fn usual() -> Self {
        let before = register::read();
        if before & register::MODES == register::USUAL {
            return Self(None);
        }
        register::write(register::USUAL);
        Self(Some(before))
    }
}

impl Drop for FloatControl {
    fn drop(&mut self) {
        if let Some(before) = self.0 {
            register::write(before);
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod register {
    use std::arch::asm;

    pub(super) type Bits = u32;
    /// All but the flags of what has happened.
    pub(super) const MODES: Bits = 0xffc0;
    /// All exceptions are masked.
    pub(super) const USUAL: Bits = 0x1f80;

    pub(super) fn read() -> Bits {
        let mut bits: Bits = 0;
        // SAFETY: it stores the register, which is as wide, to the variable.
        unsafe { asm!("stmxcsr [{}]", in(reg) &raw mut bits, options(nostack, preserves_flags)) };
        bits
    }

    pub(super) fn write(bits: Bits) {
        // SAFETY: it is what Rust expects, or what the application had set and gets back as the driver returns to it.
        unsafe { asm!("ldmxcsr [{}]", in(reg) &raw const bits, options(nostack, preserves_flags)) };
    }
}

#[cfg(target_arch = "aarch64")]
mod register {
    use std::arch::asm;

    pub(super) type Bits = u64;
    pub(super) const MODES: Bits = !0;
    /// No exception is trapped.
    pub(super) const USUAL: Bits = 0;

    pub(super) fn read() -> Bits {
        let bits;
        // SAFETY: the register may be read by any program.
        unsafe { asm!("mrs {}, fpcr", out(reg) bits, options(nostack, preserves_flags)) };
        bits
    }

    pub(super) fn write(bits: Bits) {
        // SAFETY: it is what Rust expects, or what the application had set and gets back as the driver returns to it.
        unsafe { asm!("msr fpcr, {}", in(reg) bits, options(nostack, preserves_flags)) };
    }
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
mod register {
    pub(super) type Bits = u32;
    pub(super) const MODES: Bits = 0;
    pub(super) const USUAL: Bits = 0;

    pub(super) fn read() -> Bits {
        USUAL
    }

    pub(super) fn write(_: Bits) {}
}
