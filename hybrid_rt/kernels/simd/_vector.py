"""The vector types, the lanes that suit the machine, and the checks of arguments."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import errors
from numba.core.registry import cpu_target
from numba.extending import models, register_model


def _target_features():
    """Return the names of the features that Numba compiles for, such as "avx2"."""
    _, _, features = cpu_target.target_context.codegen().magic_tuple()
    return frozenset(name[1:] for name in features.split(",") if name.startswith("+"))


FEATURES = _target_features()
"""What the compiled code may use; NUMBA_CPU_NAME and NUMBA_CPU_FEATURES change it."""

AVX512 = {"avx512f", "avx512bw", "avx512dq", "avx512vl"} <= FEATURES

WIDTH = 16 if AVX512 else 8 if "avx2" in FEATURES else 4
"""Lanes of a vector unless told otherwise: a register of 32-bit lanes."""


ELEMENT = {
    "f32": (types.float32, ir.FloatType()),
    "f64": (types.float64, ir.DoubleType()),
    "i32": (types.int32, ir.IntType(32)),
    "i64": (types.int64, ir.IntType(64)),
    "mask": (types.boolean, ir.IntType(1)),
}


NUMBERS = ("f32", "f64", "i32", "i64")


class Vector(types.Type):
    """The Numba type of a vector.

    Parameters
    ----------
    kind : {"f32", "f64", "i32", "i64", "mask"}
    lanes : int
        A power of two from 2 to 64.
    """

    def __init__(self, kind, lanes):
        if lanes not in (2, 4, 8, 16, 32, 64):
            raise errors.TypingError(f"lanes must be a power of two from 2 to 64, got {lanes}")
        self.kind = kind
        self.lanes = lanes
        super().__init__(name=f"{kind}x{lanes}")

    @property
    def group(self):
        """What the lanes are: "float", "int" or "mask"."""
        return {"f": "float", "i": "int", "m": "mask"}[self.kind[0]]

    @property
    def scalar(self):
        """The Numba type of one lane."""
        return ELEMENT[self.kind][0]

    @property
    def llvm(self):
        """The LLVM type."""
        return ir.VectorType(ELEMENT[self.kind][1], self.lanes)

    def of(self, kind):
        """Return the type of as many lanes of another kind."""
        return Vector(kind, self.lanes)


@register_model(Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, fe_type.llvm)


def fits(vector, scalar):
    """Whether a scalar may stand beside a vector: an integer vector takes no float."""
    allowed = {
        "float": (types.Integer, types.Float),
        "int": (types.Integer,),
        "mask": (types.Boolean,),
    }
    return isinstance(scalar, allowed[vector.group])


def common(name, arguments):
    """Return the vector type that scalars and vectors have in common, or say why there is none."""
    vectors = {a for a in arguments if isinstance(a, Vector)}
    if len(vectors) == 1:
        (vector,) = vectors
        if all(a is vector or fits(vector, a) for a in arguments if not isinstance(a, Vector)):
            return vector
    got = ", ".join(str(a) for a in arguments)
    raise errors.TypingError(
        f"{name} takes vectors of one kind and number of lanes, and scalars that fit; got {got}"
    )


def need(name, argument, typ, *kinds):
    """Raise unless an argument is a vector of one of some kinds."""
    if not (isinstance(typ, Vector) and typ.kind in kinds):
        raise errors.TypingError(
            f"{name}: {argument} must be a vector of kind {' or '.join(kinds)}, got {typ}"
        )


def need_integer(name, argument, typ):
    if not isinstance(typ, types.Integer):
        raise errors.TypingError(f"{name}: {argument} must be an integer, got {typ}")


def need_masked(name, kind, m, v):
    """Return the vector type of `kind` that goes with a mask, or raise if `v` cannot be in it."""
    need(name, "m", m, "mask")
    vector = m.of(kind)
    if v != vector and (isinstance(v, Vector) or not fits(vector, v)):
        raise errors.TypingError(f"{name}: wanted {vector} or a scalar that fits, got {v}")
    return vector


def lanes_of(lanes):
    """Return a number of lanes from the type of the argument that gives it, if any does."""
    if lanes is None or isinstance(lanes, (types.NoneType, types.Omitted)):
        return WIDTH
    if not isinstance(lanes, types.IntegerLiteral):
        raise errors.TypingError(f"lanes must be a constant, got {lanes}")
    return lanes.literal_value


def given(*arguments):
    """Return the types of arguments for a signature: constants as numbers, what is left out."""
    return [types.none if a is None else types.unliteral(a) for a in arguments]
