//! The list of arithmetic operations: their names, operand types and kinds. It exists once, here.

use super::register::Type;

/// The cost class of an instruction on the shader cores. The timing model reads counters by kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Kind {
    /// 32-bit float add, multiply, compare and the like: one cycle of a PE.
    Float,
    /// 32-bit integer and bit operations.
    Integer,
    /// Division, square root and transcendental functions: the special function unit.
    Special,
    /// 64-bit operations.
    Wide,
    /// Moves, assignments, conversions between representations, selection.
    Move,
    /// Operations across lanes: derivatives, votes, shuffles, reductions.
    CrossLane,
    /// Loads and stores.
    Memory,
    /// Atomic operations.
    Atomic,
    /// Image sampling, reads and writes.
    Image,
    /// Branches, loops and mask updates.
    Control,
}

impl Kind {
    /// The number of kinds.
    pub const COUNT: usize = 10;
    /// All kinds, in order of their discriminants.
    pub const ALL: [Self; Self::COUNT] = [
        Self::Float,
        Self::Integer,
        Self::Special,
        Self::Wide,
        Self::Move,
        Self::CrossLane,
        Self::Memory,
        Self::Atomic,
        Self::Image,
        Self::Control,
    ];
}

/// Operand and result types of an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signature {
    /// The operands' types.
    pub operands: &'static [Type],
    /// The result's type.
    pub result_type: Type,
}

macro_rules! type_of {
    (b) => {
        Type::Bool
    };
    (w) => {
        Type::B32
    };
    (d) => {
        Type::B64
    };
}

macro_rules! operations {
    ($($(#[doc = $doc:literal])+ $op:ident ($($operand:ident)*) -> $result:ident, $kind:ident;)*) => {
        /// An operation on registers, lane by lane. Operands and result: `b` is `Bool`, `w` is `B32`, `d` is `B64`.
        ///
        /// Names start with `F` for floats, `S` and `U` for signed and unsigned integers, `I` where the sign doesn't
        /// matter, `B` for bools; `64` ends the 64-bit forms. Integers wrap. No operation traps.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u8)]
        pub enum Op { $($(#[doc = $doc])+ $op,)* }

        impl Op {
            /// Every operation, in order.
            pub const ALL: &'static [Self] = &[$(Self::$op,)*];

            /// Its operand and result types.
            pub fn signature(self) -> Signature {
                match self {
                    $(Self::$op => Signature { operands: &[$(type_of!($operand)),*], result_type: type_of!($result) },)*
                }
            }

            /// The kind of instruction that it is, which tells its cost.
            pub fn kind(self) -> Kind {
                match self { $(Self::$op => Kind::$kind,)* }
            }

            /// Its name, as the disassembly shows it.
            pub fn name(self) -> &'static str {
                match self { $(Self::$op => stringify!($op),)* }
            }
        }
    };
}

operations! {
    // Bools.
    /// Logical and.
    BAnd(b b) -> b, Move;
    /// Logical or.
    BOr(b b) -> b, Move;
    /// Logical exclusive or (not equal).
    BXor(b b) -> b, Move;
    /// Logical not.
    BNot(b) -> b, Move;
    /// `if a { b } else { c }`, bools.
    BSelect(b b b) -> b, Move;

    // Selection and bits.
    /// `if a { b } else { c }`.
    Select(b w w) -> w, Move;
    /// `if a { b } else { c }`, 64 bits.
    Select64(b d d) -> d, Wide;
    /// Bitwise and.
    And(w w) -> w, Integer;
    /// Bitwise or.
    Or(w w) -> w, Integer;
    /// Bitwise exclusive or.
    Xor(w w) -> w, Integer;
    /// Bitwise complement.
    Not(w) -> w, Integer;
    /// `a << (b & 31)`.
    Shl(w w) -> w, Integer;
    /// Logical `a >> (b & 31)`.
    UShr(w w) -> w, Integer;
    /// Arithmetic `a >> (b & 31)`.
    SShr(w w) -> w, Integer;
    /// Bits in reverse order.
    BitReverse(w) -> w, Integer;
    /// Number of one bits.
    BitCount(w) -> w, Integer;
    /// Index of the lowest one bit, or -1 for zero.
    FindLsb(w) -> w, Integer;
    /// Index of the highest one bit, or -1 for zero.
    FindUMsb(w) -> w, Integer;
    /// Index of the highest bit that differs from the sign, or -1 for 0 and -1.
    FindSMsb(w) -> w, Integer;
    /// Base `a` with `d` bits from bit `c` replaced by the low bits of `b`. Offset and count are capped to 32.
    BitfieldInsert(w w w w) -> w, Integer;
    /// `c` bits of `a` from bit `b`, sign-extended.
    BitfieldSExtract(w w w) -> w, Integer;
    /// `c` bits of `a` from bit `b`, zero-extended.
    BitfieldUExtract(w w w) -> w, Integer;
    /// The low 8 bits, sign-extended.
    SExt8(w) -> w, Integer;
    /// The low 16 bits, sign-extended.
    SExt16(w) -> w, Integer;

    // 32-bit integers.
    /// `a + b`.
    IAdd(w w) -> w, Integer;
    /// `a - b`.
    ISub(w w) -> w, Integer;
    /// `a * b`, the low half.
    IMul(w w) -> w, Integer;
    /// The high half of the unsigned product.
    UMulHi(w w) -> w, Integer;
    /// The high half of the signed product.
    SMulHi(w w) -> w, Integer;
    /// The carry of `a + b`: 0 or 1.
    UAddCarry(w w) -> w, Integer;
    /// The borrow of `a - b`: 0 or 1.
    USubBorrow(w w) -> w, Integer;
    /// `-a`.
    INeg(w) -> w, Integer;
    /// `|a|`; the smallest integer stays itself.
    SAbs(w) -> w, Integer;
    /// -1, 0 or 1.
    SSign(w) -> w, Integer;
    /// Unsigned quotient; all ones if `b` is zero.
    UDiv(w w) -> w, Special;
    /// Unsigned remainder; `a` if `b` is zero.
    URem(w w) -> w, Special;
    /// Signed quotient, rounded towards zero; -1 if `b` is zero; wraps for MIN / -1.
    SDiv(w w) -> w, Special;
    /// Signed remainder with the sign of `a`; `a` if `b` is zero.
    SRem(w w) -> w, Special;
    /// Signed remainder with the sign of `b`; `a` if `b` is zero.
    SMod(w w) -> w, Special;
    /// Signed minimum.
    SMin(w w) -> w, Integer;
    /// Signed maximum.
    SMax(w w) -> w, Integer;
    /// Unsigned minimum.
    UMin(w w) -> w, Integer;
    /// Unsigned maximum.
    UMax(w w) -> w, Integer;
    /// `a == b`.
    IEq(w w) -> b, Integer;
    /// `a != b`.
    INe(w w) -> b, Integer;
    /// Signed `a < b`.
    SLt(w w) -> b, Integer;
    /// Signed `a <= b`.
    SLe(w w) -> b, Integer;
    /// Unsigned `a < b`.
    ULt(w w) -> b, Integer;
    /// Unsigned `a <= b`.
    ULe(w w) -> b, Integer;

    // 32-bit floats.
    /// `a + b`.
    FAdd(w w) -> w, Float;
    /// `a - b`.
    FSub(w w) -> w, Float;
    /// `a * b`.
    FMul(w w) -> w, Float;
    /// `a * b + c`, fused where the host fuses.
    FFma(w w w) -> w, Float;
    /// `a * b - c`, fused where the host fuses.
    FMulSub(w w w) -> w, Float;
    /// `c - a * b`, fused where the host fuses.
    FNegMulAdd(w w w) -> w, Float;
    /// `a / b`.
    FDiv(w w) -> w, Special;
    /// Remainder with the sign of `a` (C's `fmod`).
    FRem(w w) -> w, Special;
    /// Remainder with the sign of `b`: `a - b * floor(a / b)`.
    FMod(w w) -> w, Special;
    /// `-a`.
    FNeg(w) -> w, Float;
    /// `|a|`.
    FAbs(w) -> w, Float;
    /// -1, 0 or 1, and zero for NaN.
    FSign(w) -> w, Float;
    /// The next integer at or below.
    FFloor(w) -> w, Float;
    /// The next integer at or above.
    FCeil(w) -> w, Float;
    /// The integer part.
    FTrunc(w) -> w, Float;
    /// The nearest integer, halves to even.
    FRoundEven(w) -> w, Float;
    /// `a - floor(a)`.
    FFract(w) -> w, Float;
    /// The smaller; if one is NaN, the other.
    FMin(w w) -> w, Float;
    /// The larger; if one is NaN, the other.
    FMax(w w) -> w, Float;
    /// Square root.
    FSqrt(w) -> w, Special;
    /// `1 / sqrt(a)`.
    FInverseSqrt(w) -> w, Special;
    /// Ordered `a == b`.
    FEq(w w) -> b, Float;
    /// Unordered `a != b`: true if either is NaN.
    FNe(w w) -> b, Float;
    /// Ordered `a < b`.
    FLt(w w) -> b, Float;
    /// Ordered `a <= b`.
    FLe(w w) -> b, Float;
    /// Ordered `a != b`: false if either is NaN.
    FLtGt(w w) -> b, Float;
    /// True if `a` is NaN.
    FIsNan(w) -> b, Float;
    /// True if `a` is an infinity.
    FIsInf(w) -> b, Float;

    // Transcendental functions, 32-bit floats, FExp to FAtanh. Errors are stated and tested in `kernels::elementary`.
    /// e to the power of `a`.
    FExp(w) -> w, Special;
    /// 2 to the power of `a`.
    FExp2(w) -> w, Special;
    /// Natural logarithm.
    FLog(w) -> w, Special;
    /// Logarithm to base 2.
    FLog2(w) -> w, Special;
    /// `a` to the power of `b`; NaN for negative `a`.
    FPow(w w) -> w, Special;
    /// Sine of radians.
    FSin(w) -> w, Special;
    /// Cosine of radians.
    FCos(w) -> w, Special;
    /// Tangent of radians.
    FTan(w) -> w, Special;
    /// Arc sine.
    FAsin(w) -> w, Special;
    /// Arc cosine.
    FAcos(w) -> w, Special;
    /// Arc tangent.
    FAtan(w) -> w, Special;
    /// Angle of the point (`b`, `a`): y first, as in C.
    FAtan2(w w) -> w, Special;
    /// Hyperbolic sine.
    FSinh(w) -> w, Special;
    /// Hyperbolic cosine.
    FCosh(w) -> w, Special;
    /// Hyperbolic tangent.
    FTanh(w) -> w, Special;
    /// Inverse hyperbolic sine.
    FAsinh(w) -> w, Special;
    /// Inverse hyperbolic cosine.
    FAcosh(w) -> w, Special;
    /// Inverse hyperbolic tangent.
    FAtanh(w) -> w, Special;
    /// `a * 2^b`, `b` a signed integer; correctly rounded, overflow to infinity.
    FLdexp(w w) -> w, Float;
    /// The significand of `frexp`: in [0.5, 1), or `a` itself if zero, infinite or NaN.
    FFrexpSignificand(w) -> w, Float;
    /// The exponent of `frexp`, an integer; zero if `a` is zero, infinite or NaN.
    FFrexpExponent(w) -> w, Float;

    // Conversions.
    /// Float to signed, towards zero, saturating; NaN gives 0.
    FToS(w) -> w, Move;
    /// Float to unsigned, towards zero, saturating; NaN gives 0.
    FToU(w) -> w, Move;
    /// Signed to float, nearest even.
    SToF(w) -> w, Move;
    /// Unsigned to float, nearest even.
    UToF(w) -> w, Move;
    /// Float to the bits of an `f16` (nearest even) in the low half; the high half is zero.
    FToF16(w) -> w, Move;
    /// The `f16` in the low half, to float.
    F16ToF(w) -> w, Move;
    /// A float rounded to what an `f16` can hold (nearest even).
    RoundToF16(w) -> w, Move;
    /// `f32` to `f64`.
    FToF64(w) -> d, Wide;
    /// `f64` to `f32`, nearest even.
    F64ToF(d) -> w, Wide;
    /// `f64` to `i32`, saturating; NaN gives 0.
    F64ToS(d) -> w, Wide;
    /// `f64` to `u32`, saturating; NaN gives 0.
    F64ToU(d) -> w, Wide;
    /// `i32` to `f64`.
    SToF64(w) -> d, Wide;
    /// `u32` to `f64`.
    UToF64(w) -> d, Wide;
    /// `f64` to `i64`, saturating; NaN gives 0.
    F64ToS64(d) -> d, Wide;
    /// `f64` to `u64`, saturating; NaN gives 0.
    F64ToU64(d) -> d, Wide;
    /// `i64` to `f64`.
    S64ToF64(d) -> d, Wide;
    /// `u64` to `f64`.
    U64ToF64(d) -> d, Wide;
    /// `f32` to `i64`, saturating; NaN gives 0.
    FToS64(w) -> d, Wide;
    /// `f32` to `u64`, saturating; NaN gives 0.
    FToU64(w) -> d, Wide;
    /// `i64` to `f32`, nearest even.
    S64ToF(d) -> w, Wide;
    /// `u64` to `f32`, nearest even.
    U64ToF(d) -> w, Wide;
    /// Sign extension to 64 bits.
    SToS64(w) -> d, Wide;
    /// Zero extension to 64 bits.
    UToU64(w) -> d, Wide;
    /// The low half of 64 bits (also: narrowing to 32 bits).
    Low32(d) -> w, Wide;
    /// The high half of 64 bits.
    High32(d) -> w, Wide;
    /// 64 bits from a low and a high half.
    Join64(w w) -> d, Wide;

    // 64-bit floats.
    /// `a + b`.
    FAdd64(d d) -> d, Wide;
    /// `a - b`.
    FSub64(d d) -> d, Wide;
    /// `a * b`.
    FMul64(d d) -> d, Wide;
    /// `a / b`.
    FDiv64(d d) -> d, Wide;
    /// `a * b + c`, fused.
    FFma64(d d d) -> d, Wide;
    /// Remainder with the sign of `a`.
    FRem64(d d) -> d, Wide;
    /// Remainder with the sign of `b`.
    FMod64(d d) -> d, Wide;
    /// `-a`.
    FNeg64(d) -> d, Wide;
    /// `|a|`.
    FAbs64(d) -> d, Wide;
    /// -1, 0 or 1, and zero for NaN.
    FSign64(d) -> d, Wide;
    /// The next integer at or below.
    FFloor64(d) -> d, Wide;
    /// The next integer at or above.
    FCeil64(d) -> d, Wide;
    /// The integer part.
    FTrunc64(d) -> d, Wide;
    /// The nearest integer, halves to even.
    FRoundEven64(d) -> d, Wide;
    /// `a - floor(a)`.
    FFract64(d) -> d, Wide;
    /// The smaller; if one is NaN, the other.
    FMin64(d d) -> d, Wide;
    /// The larger; if one is NaN, the other.
    FMax64(d d) -> d, Wide;
    /// Square root.
    FSqrt64(d) -> d, Wide;
    /// Ordered `a == b`.
    FEq64(d d) -> b, Wide;
    /// Unordered `a != b`.
    FNe64(d d) -> b, Wide;
    /// Ordered `a < b`.
    FLt64(d d) -> b, Wide;
    /// Ordered `a <= b`.
    FLe64(d d) -> b, Wide;
    /// Ordered `a != b`: false if either is NaN.
    FLtGt64(d d) -> b, Wide;
    /// True if `a` is NaN.
    FIsNan64(d) -> b, Wide;
    /// True if `a` is an infinity.
    FIsInf64(d) -> b, Wide;
    /// `a * 2^b`, `b` a signed 32-bit integer.
    FLdexp64(d w) -> d, Wide;
    /// The significand of `frexp`.
    FFrexpSignificand64(d) -> d, Wide;
    /// The exponent of `frexp`, a 32-bit integer.
    FFrexpExponent64(d) -> w, Wide;

    // 64-bit integers.
    /// `a + b`.
    IAdd64(d d) -> d, Wide;
    /// `a - b`.
    ISub64(d d) -> d, Wide;
    /// `a * b`, the low half.
    IMul64(d d) -> d, Wide;
    /// `-a`.
    INeg64(d) -> d, Wide;
    /// `|a|`; the smallest integer stays itself.
    SAbs64(d) -> d, Wide;
    /// -1, 0 or 1.
    SSign64(d) -> d, Wide;
    /// Unsigned quotient; all ones if `b` is zero.
    UDiv64(d d) -> d, Wide;
    /// Unsigned remainder; `a` if `b` is zero.
    URem64(d d) -> d, Wide;
    /// Signed quotient, towards zero; -1 if `b` is zero; wraps for MIN / -1.
    SDiv64(d d) -> d, Wide;
    /// Signed remainder with the sign of `a`; `a` if `b` is zero.
    SRem64(d d) -> d, Wide;
    /// Signed remainder with the sign of `b`; `a` if `b` is zero.
    SMod64(d d) -> d, Wide;
    /// Bitwise and.
    And64(d d) -> d, Wide;
    /// Bitwise or.
    Or64(d d) -> d, Wide;
    /// Bitwise exclusive or.
    Xor64(d d) -> d, Wide;
    /// Bitwise complement.
    Not64(d) -> d, Wide;
    /// `a << (b & 63)`, `b` 32 bits.
    Shl64(d w) -> d, Wide;
    /// Logical `a >> (b & 63)`, `b` 32 bits.
    UShr64(d w) -> d, Wide;
    /// Arithmetic `a >> (b & 63)`, `b` 32 bits.
    SShr64(d w) -> d, Wide;
    /// `a == b`.
    IEq64(d d) -> b, Wide;
    /// `a != b`.
    INe64(d d) -> b, Wide;
    /// Signed `a < b`.
    SLt64(d d) -> b, Wide;
    /// Signed `a <= b`.
    SLe64(d d) -> b, Wide;
    /// Unsigned `a < b`.
    ULt64(d d) -> b, Wide;
    /// Unsigned `a <= b`.
    ULe64(d d) -> b, Wide;
    /// Signed minimum.
    SMin64(d d) -> d, Wide;
    /// Signed maximum.
    SMax64(d d) -> d, Wide;
    /// Unsigned minimum.
    UMin64(d d) -> d, Wide;
    /// Unsigned maximum.
    UMax64(d d) -> d, Wide;
}
