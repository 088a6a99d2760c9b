"""Compares the worst errors of elementary functions with MPFR, 200 bits wide.

    GAURAST_TEST_LONG=1 cargo test --release -p gaurast-isa --lib errors:: > errors.txt
    python3 simdevice/isa/src/tests/worst_errors.py errors.txt

It reads the lines `worst,FUNCTION,ARGUMENT,RESULT,ULPS` of the test: the bits of the argument and of the result in binary32, and
the error that the test found with binary64. For each function it prints the number of lines, the greatest error, and the greatest
difference between the two errors. It fails if one is more than a millionth. It needs the package python3-gmpy2.
"""

import collections
import struct
import sys

import gmpy2
from gmpy2 import mpfr

gmpy2.get_context().precision = 200

FUNCTIONS = {
    "FExp": gmpy2.exp,
    "FExp2": gmpy2.exp2,
    "FLog": gmpy2.log,
    "FLog2": gmpy2.log2,
    "FSin": gmpy2.sin,
    "FCos": gmpy2.cos,
    "FTan": gmpy2.tan,
    "FAsin": gmpy2.asin,
    "FAcos": gmpy2.acos,
    "FAtan": gmpy2.atan,
    "FSinh": gmpy2.sinh,
    "FCosh": gmpy2.cosh,
    "FTanh": gmpy2.tanh,
    "FAsinh": gmpy2.asinh,
    "FAcosh": gmpy2.acosh,
    "FAtanh": gmpy2.atanh,
    "FInverseSqrt": gmpy2.rec_sqrt,
}
# Results of a smaller magnitude have the unit in the last place of this one.
LEAST = {"FSin": 0.5, "FCos": 0.5}


def binary32(bits):
    return mpfr(struct.unpack("<f", struct.pack("<I", int(bits)))[0])


def ulp(magnitude):
    """The distance of binary32 numbers at a magnitude."""
    exponent = int(gmpy2.floor(gmpy2.log2(magnitude))) if magnitude > 0 else -126
    return mpfr(2) ** (min(max(exponent, -126), 127) - 23)


def main(path):
    counts, greatest, apart = collections.Counter(), collections.Counter(), collections.Counter()
    with open(path) as lines:
        for line in lines:
            if not line.startswith("worst,"):
                continue
            _, name, argument, result, found = line.strip().split(",")
            exact = FUNCTIONS[name](binary32(argument))
            got = binary32(result)
            finite = gmpy2.is_finite(exact) and gmpy2.is_finite(got)
            error = abs(got - exact) / ulp(max(abs(exact), LEAST.get(name, 0))) if finite else mpfr(found)
            counts[name] += 1
            greatest[name] = max(greatest[name], float(error))
            apart[name] = max(apart[name], abs(float(error) - float(found)))
    for name, count in counts.items():
        print(f"{name}: {count} arguments, greatest error {greatest[name]:.4f} ulp, {apart[name]:.1e} from binary64's")
    return 0 if counts and max(apart.values()) < 1e-6 else 1


sys.exit(main(sys.argv[1]))
