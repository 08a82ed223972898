"""Explicit SIMD vectors for Numba: a vector is one LLVM vector, most operations an instruction.

A vector has a kind (f32, f64, i32, i64 or mask) and a number of lanes. The lanes are `WIDTH` unless
a constructor is told otherwise, so code that names no number runs on any machine, and a mask fits
vectors of every kind; LLVM splits what is wider than a register. Everything here is for compiled
code only; nothing can be called from Python.

    @kernel
    def saxpy(a, x, y, out):
        n = x.size
        for i in range(0, n, WIDTH):
            live = first(n - i)
            v = a * load_masked(x, i, live, 0.0) + load_masked(y, i, live, 0.0)
            store_masked(out, i, v, live)

Operators are Python's: `+ - *` and unary `-` on numbers, `/` on floats, `< <= > >= == !=` giving a
mask, `& | ^ ~` on masks and integers, `<< >>` on integers. One operand may be a scalar: it is
converted to the kind of the vector and stands in all lanes. `and`, `or` and `not` on masks do not
compile: they are control flow. No operation is reordered, contracted or approximated, so each lane
is NumPy's answer bit for bit, the payload of a NaN aside (integers wrap; comparisons with NaN are
false, `!=` is true). Counts of `<<` and `>>` are taken modulo the bits of a lane.

`WIDTH` follows from the name and the features of the CPU that Numba compiles for and from nothing
else. Numba's cache on disk is keyed by just these, so that code cached for one width is never
loaded for another. That cache does not know of this package's source: after an edit here, cached
code of its callers is old.
"""

from __future__ import annotations

from . import operators as operators  # gives Python's operators to Numba
from ._vector import AVX512, WIDTH, Vector
from .across import (
    all_,
    any_,
    bits,
    count,
    extract,
    insert,
    lowest,
    reduce_add,
    reduce_min,
)
from .lanewise import (
    absolute,
    bits_i32,
    bits_i64,
    float_of_bits,
    floor,
    maximum,
    minimum,
    root,
    select,
    to_f32,
    to_f64,
    to_i32,
    to_i64,
)
from .make import f32, f64, first, i32, i64, iota, mask, mask_of_bits
from .memory import gather, load, load_masked, scatter, store, store_masked
from .packing import compress, expand
from .records import pull, push, rows_of, select_each
from .together import interleave, part
from .triples import load_triples, store_triples

__all__ = [
    "AVX512",
    "WIDTH",
    "Vector",
    "absolute",
    "all_",
    "any_",
    "bits",
    "bits_i32",
    "bits_i64",
    "compress",
    "count",
    "expand",
    "extract",
    "f32",
    "f64",
    "first",
    "float_of_bits",
    "floor",
    "gather",
    "i32",
    "i64",
    "insert",
    "interleave",
    "iota",
    "load",
    "load_masked",
    "load_triples",
    "lowest",
    "mask",
    "mask_of_bits",
    "maximum",
    "minimum",
    "part",
    "pull",
    "push",
    "reduce_add",
    "reduce_min",
    "root",
    "rows_of",
    "scatter",
    "select",
    "select_each",
    "store",
    "store_masked",
    "store_triples",
    "to_f32",
    "to_f64",
    "to_i32",
    "to_i64",
]
