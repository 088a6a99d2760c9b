//! Operations of shaders over the ranges of their operands: a kernel for each, which writes a word for each invocation.
//!
//! Operands are bit patterns of a generator of integers, half of them moderate numbers. The bits of a NaN are open
//! (`docs/arithmetic.md`), so that a result that is NaN becomes one pattern.

use gaurast_testkit::{Bindings, Buffer, Gpu, Kernel, Resource};

/// Invocations of a kernel.
const INVOCATIONS: u32 = 1 << 13;
/// Invocations of a workgroup.
const GROUP: u32 = 64;

/// The type of an expression's result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ResultType {
    /// A word.
    Word,
    /// A number of 32 bits.
    Float,
    /// A number of 64 bits.
    Double,
}

impl ResultType {
    /// The number of words that an invocation writes.
    fn words(self) -> u32 {
        match self {
            Self::Word | Self::Float => 1,
            Self::Double => 2,
        }
    }

    /// The statement that writes an expression.
    fn store(self, expression: &str) -> String {
        match self {
            Self::Word => format!("found[at] = {expression};"),
            Self::Float => format!(
                "float result = {expression}; found[at] = isnan(result) ? 0x7fc00000u : floatBitsToUint(result);"
            ),
            Self::Double => format!(
                "double result = {expression}; \
                 uvec2 halves = isnan(result) ? uvec2(0u, 0x7ff80000u) : unpackDouble2x32(result); \
                 found[2 * at] = halves.x; found[2 * at + 1] = halves.y;"
            ),
        }
    }
}

/// Expressions of one group, which have one type. Operands are x, y and z (floats), a, b and c (doubles), h, k and l
/// (halves), i and j (integers), u and v (unsigned integers), m and n (integers of 64 bits), and the finite floats p, q
/// and r.
const GROUPS: &[(ResultType, &[&str])] = &[
    (
        ResultType::Float,
        &[
            "x + y",
            "x - y",
            "x * y",
            "x / y",
            "-x",
            "abs(x)",
            "sign(x)",
            "floor(x)",
            "ceil(x)",
            "trunc(x)",
            "round(x)",
            "roundEven(x)",
            "fract(x)",
            "sqrt(x)",
            "inversesqrt(x)",
            "exp(x)",
            "exp2(x)",
            "log(x)",
            "log2(x)",
            "sin(x)",
            "cos(x)",
            "tan(x)",
            "asin(x)",
            "acos(x)",
            "atan(x)",
            "sinh(x)",
            "cosh(x)",
            "tanh(x)",
            "asinh(x)",
            "acosh(x)",
            "atanh(x)",
            "degrees(x)",
            "radians(x)",
            "pow(x, y)",
            "atan(x, y)",
            "mod(x, y)",
            "min(x, y)",
            "max(x, y)",
            "step(x, y)",
            "fma(x, y, z)",
            "x * y + z",
            "x * y - z",
            "z - x * y",
            "clamp(x, y, z)",
            "mix(x, y, z)",
            "smoothstep(x, y, z)",
            "length(vec3(x, y, z))",
            "distance(vec2(x, y), vec2(z, x))",
            "normalize(vec3(x, y, z)).y",
            "dot(vec3(x, y, z), vec3(z, x, y))",
            "dot(vec4(x, y, z, x), vec4(z, x, y, y))",
            "cross(vec3(x, y, z), vec3(y, z, x)).x",
            "reflect(vec3(x, y, z), vec3(y, z, x)).x",
            "refract(normalize(vec3(p, q, r)), normalize(vec3(q, r, p)), 0.7).x",
            "faceforward(vec3(x, y, z), vec3(y, z, x), vec3(z, z, y)).x",
            "(mat2(x, y, z, x) * vec2(y, z)).x",
            "(vec3(x, y, z) * mat3(x, y, z, z, x, y, y, z, x)).z",
            "(mat4(x, y, z, x, y, z, x, y, z, x, y, z, x, y, z, x) * mat4(z))[1][2]",
            "determinant(mat2(x, y, z, x))",
            "determinant(mat3(x, y, z, z, y, x, y, z, x))",
            "inverse(mat2(x, y, z, x))[0][1]",
            "inverse(mat3(p, q, r, r, p, q, q, p, p))[1][1]",
            "outerProduct(vec2(x, y), vec2(y, z))[1][0]",
            "ldexp(x, i >> 22)",
            "modf_whole(x)",
            "modf_rest(x)",
            "frexp_significand(x)",
            "float(i)",
            "float(u)",
            "float(m)",
            "float(a)",
            "float(h)",
            "unpackHalf2x16(u).x",
            "unpackUnorm4x8(u).y",
            "unpackSnorm4x8(u).z",
            "unpackUnorm2x16(u).x",
            "unpackSnorm2x16(u).y",
            "float(float16_t(x))",
            "float(h + k)",
            "float(h * k)",
            "float(h / k)",
            "float(fma(h, k, l))",
            "float(sqrt(h))",
            "float(exp(h))",
            "float(log2(h))",
            "float(sin(h))",
            "float(pow(h, k))",
            "float(floor(h))",
            "float(mix(h, k, l))",
            "float(float16_t(a))",
            "subgroupAdd(p)",
            "subgroupMul(p)",
            "subgroupMin(x)",
            "subgroupMax(x)",
            "subgroupInclusiveAdd(p)",
            "subgroupExclusiveAdd(p)",
            "subgroupExclusiveMul(p)",
        ],
    ),
    (
        ResultType::Double,
        &[
            "a + b",
            "a - b",
            "a * b",
            "a / b",
            "fma(a, b, c)",
            "a * b + c",
            "sqrt(a)",
            "inversesqrt(a)",
            "floor(a)",
            "ceil(a)",
            "trunc(a)",
            "fract(a)",
            "roundEven(a)",
            "mod(a, b)",
            "min(a, b)",
            "max(a, b)",
            "mix(a, b, c)",
            "length(dvec3(a, b, c))",
            "normalize(dvec2(a, b)).x",
            "dot(dvec3(a, b, c), dvec3(c, a, b))",
            "smoothstep(a, b, c)",
            "double(x)",
            "double(i)",
            "double(m)",
            "ldexp(a, i >> 22)",
        ],
    ),
    (
        ResultType::Word,
        &[
            "u + v",
            "u * v",
            "u / (v | 1u)",
            "u % (v | 1u)",
            "uint(i / (j | 1))",
            "uint(i % (j | 1))",
            "u << (v & 31u)",
            "u >> (v & 31u)",
            "uint(i >> (j & 31))",
            "~u ^ v",
            "uint(bitCount(u))",
            "bitfieldReverse(u)",
            "uint(findLSB(u))",
            "uint(findMSB(u))",
            "uint(findMSB(i))",
            "uint(bitfieldExtract(i, j & 15, i & 15))",
            "bitfieldExtract(u, j & 15, i & 15)",
            "bitfieldInsert(u, v, j & 15, i & 15)",
            "uint(abs(i))",
            "uint(sign(i))",
            "uint(clamp(i, min(i, j), max(i, j)))",
            "multiplied(u, v)",
            "carried(u, v)",
            "borrowed(u, v)",
            "uint(m * n) ^ uint((m * n) >> 32)",
            "uint((m / (n | 1L)) >> 7)",
            "uint(m >> (i & 63))",
            "uint(uint16_t(u) * uint16_t(v))",
            "uint(int8_t(i) * int8_t(j))",
            "uint(int(x))",
            "uint(x)",
            "uint(int(a))",
            "uint(a)",
            "uint(int64_t(a) >> 13)",
            "uint(x < y) | uint(x <= y) << 1 | uint(x == y) << 2 | uint(x != y) << 3",
            "uint(isnan(x)) | uint(isinf(x)) << 1",
            "uint(a < b) | uint(a >= b) << 1 | uint(a == b) << 2",
            "packHalf2x16(vec2(p, q))",
            "packUnorm4x8(vec4(x, y, z, p))",
            "packSnorm4x8(vec4(x, y, z, p))",
            "packUnorm2x16(vec2(x, y))",
            "packSnorm2x16(vec2(x, y))",
            "uint(frexp_exponent(p))",
            "subgroupXor(u)",
            "subgroupInclusiveMax(i) ^ u",
            "subgroupShuffleXor(u, 5u)",
            "subgroupBallot(x < y).x",
        ],
    ),
];

/// An operation: an expression and the type of its result.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Operation {
    result: ResultType,
    /// The expression, in GLSL.
    pub(crate) expression: &'static str,
}

/// All operations.
pub(crate) fn all() -> impl Iterator<Item = Operation> {
    let group = |(result, expressions): &'static (ResultType, &[&str])| {
        expressions.iter().map(|&expression| Operation { result: *result, expression })
    };
    GROUPS.iter().flat_map(group)
}

const PRELUDE: &str = "
    #extension GL_EXT_shader_explicit_arithmetic_types : require
    #extension GL_KHR_shader_subgroup_arithmetic : require
    #extension GL_KHR_shader_subgroup_ballot : require
    #extension GL_KHR_shader_subgroup_shuffle : require
    layout(local_size_x = 64) in;
    layout(binding = 0) buffer Found { uint found[]; };
    uint state;
    uint next() {
        state ^= state << 13; state ^= state >> 17; state ^= state << 5;
        return state;
    }
    bool coin() { return (next() & 0x10000u) == 0u; }
    float number() {
        uint bits = next();
        return uintBitsToFloat(coin() ? bits : bits & 0x83ffffffu | 0x3c000000u);
    }
    float finite() { return uintBitsToFloat(next() & 0x83ffffffu | 0x3c000000u); }
    double wide() {
        uvec2 bits = uvec2(next(), next());
        return packDouble2x32(coin() ? bits : uvec2(bits.x, bits.y & 0x803fffffu | 0x3fc00000u));
    }
    float16_t narrow() {
        uint bits = next();
        return unpackFloat2x16(coin() ? bits : bits & 0x83ffu | 0x3800u).x;
    }
    float modf_whole(float value) { float whole; modf(value, whole); return whole; }
    float modf_rest(float value) { float whole; return modf(value, whole); }
    float frexp_significand(float value) { int exponent; return frexp(value, exponent); }
    int frexp_exponent(float value) { int exponent; frexp(value, exponent); return exponent; }
    uint multiplied(uint u, uint v) { uint high, low; umulExtended(u, v, high, low); return high ^ low; }
    uint carried(uint u, uint v) { uint carry; return uaddCarry(u, v, carry) ^ carry; }
    uint borrowed(uint u, uint v) { uint borrow; return usubBorrow(u, v, borrow) ^ borrow; }";

/// The words that an operation's kernel writes.
pub(crate) fn words(gpu: &Gpu, operation: Operation) -> Vec<u32> {
    let Operation { result, expression } = operation;
    let store = result.store(expression);
    let source = format!(
        "{PRELUDE}
        void main() {{
            uint at = gl_GlobalInvocationID.x;
            state = 0x9e3779b9u * (at + 1u);
            float x = number(), y = number(), z = number(), p = finite(), q = finite(), r = finite();
            double a = wide(), b = wide(), c = wide();
            float16_t h = narrow(), k = narrow(), l = narrow();
            int i = int(next()), j = int(next());
            uint u = next(), v = next();
            int64_t m = int64_t(next()) << 32 | int64_t(next()), n = int64_t(next()) << 32 | int64_t(next());
            {store}
        }}"
    );
    let found = Buffer::new(gpu, u64::from(4 * result.words() * INVOCATIONS));
    let bindings = Bindings::new(gpu, &[Resource::Storage(found.raw)]);
    Kernel::new(gpu, &source, &bindings).run(&[bindings.set], &[], [INVOCATIONS / GROUP, 1, 1]);
    found.values()
}
