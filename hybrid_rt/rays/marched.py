"""What a march says about each ray."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hybrid_rt import _check
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import F32, I32, I64, U8, Bool, MarchedArrays
from hybrid_rt.rays.hits import LARGEST


class MarchStatus(enum.IntEnum):
    """How the march of one ray ended."""

    HIT = 0
    """A pixel answers the ray."""
    MISS = 1
    """The ray stays in front of everything, for ever (or up to its t_far)."""
    OFFSCREEN = 2
    """It leaves the image sideways."""
    HIDDEN = 3
    """It meets or goes behind a visible surface, and what the screen holds does not answer it."""
    NEAR = 4
    """It leaves through the near plane, towards the observer."""
    EXHAUSTED = 5
    """The step budget ran out."""
    INVALID = 6
    """NaN, an infinity or a zero direction."""
    UNDECIDED = 7
    """Certified only: two hits, or a hit and a miss, are closer than float64 can tell apart."""
    SKIPPED = 8
    """Certified only: not marched, since no probe near it in the order of the rays was resolved."""


@dataclass(frozen=True)
class MarchWork:
    """What the lanes of a march went through, over all rays and workers.

    A stage goes through vectors of `lanes` lanes, of which some are at work. All but the numbers of
    vectors are the same however rays are put into lanes.

    Attributes
    ----------
    lanes : int
        Of a vector.
    step_vectors, steps, passes : int
        Steps read the pyramid, passes leave a pixel that has been looked at.
    refills : int
        Lanes that were given a ray to walk.
    look_vectors, looks : int
        Pixels whose lists were looked at, once for each time that a ray was sent there.
    entry_vectors, entries : int
        Entries of lists that were read.
    rests : int
        Lists that were gone through to their end.
    plane_vectors, planes : int
        Planes of triangles that were read.
    test_vectors, tests : int
        Exact tests.
    """

    lanes: int
    step_vectors: int
    steps: int
    passes: int
    refills: int
    look_vectors: int
    looks: int
    entry_vectors: int
    entries: int
    rests: int
    plane_vectors: int
    planes: int
    test_vectors: int
    tests: int

    @property
    def busy(self) -> dict[str, float]:
        """Share of the lanes at work, for each stage; NaN for one that nothing came to."""
        stages = {
            "step": (self.steps + self.passes, self.step_vectors),
            "look": (self.looks, self.look_vectors),
            "entry": (self.entries, self.entry_vectors),
            "plane": (self.planes, self.plane_vectors),
            "test": (self.tests, self.test_vectors),
        }
        return {
            stage: at_work / (vectors * self.lanes) if vectors else math.nan
            for stage, (at_work, vectors) in stages.items()
        }


@dataclass(frozen=True, eq=False)
class Marched:
    """What the screen says about each ray.

    Attributes
    ----------
    status : (N,) uint8
        A `MarchStatus` for each ray.
    resolved : (N,) bool
        Whether the march answers the ray, with a hit or, where `prim_id` is -1, with a miss. What
        resolves a ray is up to the technique.
    pixel : (N, 2) int32
        The pixel (x, y) that answers the ray with a hit, else (-1, -1). An answer from lists of
        another view than the G-buffer's has none.
    prim_id : (N,) int32
        The primitive that is hit, -1 for a miss and for unresolved.
    t : (N,) float32
        Where it is hit, infinity for a miss and for unresolved.
    t_free : (N,) float32
        Up to here the march found the ray in front of everything that it read.
    steps : (N,) int32
        Samples of the pyramid that the ray took.
    steps_by_level : (L,) int64, optional
        The same, summed over the rays, for each level; None where it was not counted.
    tests : int
        Exact tests of a ray against a primitive, over all rays; only "certified" makes any.
    work : MarchWork, optional
        What the lanes went through; None where the march has none.
    """

    status: U8
    resolved: Bool
    pixel: I32
    prim_id: I32
    t: F32
    t_free: F32
    steps: I32
    steps_by_level: I64 | None = None
    tests: int = 0
    work: MarchWork | None = None

    @classmethod
    def unfilled(cls, n: int) -> Marched:
        """Return room for `n` rays, with nothing in it yet, for code that writes every row."""
        n = _check.integer("n", n, least=0, most=LARGEST)
        return cls(
            np.empty(n, np.uint8),
            np.empty(n, np.bool_),
            np.empty((n, 2), np.int32),
            np.empty(n, np.int32),
            np.empty(n, np.float32),
            np.empty(n, np.float32),
            np.empty(n, np.int32),
        )

    @classmethod
    def unresolved(cls, n: int) -> Marched:
        """Return `n` rays that nothing is known of, for code that writes the others."""
        marched = cls.unfilled(n)
        nothing: list[Any] = [MarchStatus.HIDDEN, False, -1, -1, np.inf, 0.0, 0]
        for array, value in zip(marched.arrays, nothing, strict=True):
            np.asarray(array).fill(value)
        return marched

    @property
    def arrays(self) -> MarchedArrays:
        """The arrays with a row for each ray, in the order of the attributes, for kernels."""
        return MarchedArrays(
            self.status,
            self.resolved,
            self.pixel,
            self.prim_id,
            self.t,
            self.t_free,
            self.steps,
        )

    def _checked(self, argument: str, n: int, faces: int, width: int, height: int) -> Marched:
        """Return this if it can be what a screen says of N rays.

        Raises
        ------
        ArgumentError
            Arrays of another length, shape or dtype; an unknown status; a prim_id that the scene
            or a pixel that the screen does not have; a resolved hit whose t is not finite.
            `argument` is what it is called in it.
        """
        shapes: tuple[tuple[str, tuple[int, ...], type[np.generic]], ...] = (
            ("status", (n,), np.uint8),
            ("resolved", (n,), np.bool_),
            ("pixel", (n, 2), np.int32),
            ("prim_id", (n,), np.int32),
            ("t", (n,), np.float32),
            ("t_free", (n,), np.float32),
            ("steps", (n,), np.int32),
        )
        rows: dict[str, Any] = {
            name: _check.array(f"{argument}.{name}", getattr(self, name), shape, dtype)
            for name, shape, dtype in shapes
        }
        marched = replace(self, **rows)
        for name, values, low, high, what in (
            ("status", marched.status, 0, len(MarchStatus) - 1, "of MarchStatus"),
            ("prim_id", marched.prim_id, -1, faces - 1, f"{faces} triangles"),
            ("pixel", marched.pixel[:, 0], -1, width - 1, f"{width} columns"),
            ("pixel", marched.pixel[:, 1], -1, height - 1, f"{height} rows"),
        ):
            _check.in_range(f"{argument}.{name}", values, low, high, what)
        hit = marched.resolved & (marched.prim_id >= 0)
        if not np.isfinite(marched.t[hit]).all():
            raise ArgumentError(f"{argument}.t", "a finite t for every resolved hit", "others")
        return marched

    def __repr__(self) -> str:
        hits = int((self.resolved & (self.prim_id >= 0)).sum())
        misses = int(self.resolved.sum()) - hits
        return f"<Marched: {len(self)} rays, {hits} hits and {misses} misses resolved>"

    def __len__(self) -> int:
        return len(self.status)
