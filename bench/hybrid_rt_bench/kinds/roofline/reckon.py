"""What a roofline is made of: stages, structures, and what gathers alone would take.

It reckons with the rows of results only, so that a report needs nothing else.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

STAGES = ("embree", "march", "compaction", "fallback", "merge", "scalar", "start")
"""What is timed in a round, seconds: Embree for all rays, the four stages of the hybrid (fallback
is Embree for the unresolved rays), the march without vectors and a march of one step."""

RASTER = ("vertices", "cull", "records", "tiles")
"""Stages of the raster, as in `GBuffer.timings`; beside them are timed "raster", the whole, and
"primary", the strongest Embree for the primary rays of the same view."""

STRUCTURES = ("pyramid", "lists", "planes", "corners", "slots")
"""What the march gathers from: the depth pyramid, the lists of primitives, the planes of triangles,
their corners, and its own slots."""


def budget(seconds: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the break-even march time: with it the hybrid is as fast as Embree for all rays.

    That is Embree's time for all rays less what the hybrid takes beside the march: a list of the
    unresolved rays, Embree for these from where they are handed over, the hits of the others.
    """
    return seconds["embree"] - seconds["compaction"] - seconds["fallback"] - seconds["merge"]


def ns_element(rates: Sequence[Mapping[str, Any]], size: float, threads: int) -> float:
    """Return the time of a gathered 32-bit element, ns, from a working set of `size` bytes.

    Parameters
    ----------
    rates : sequence of mapping
        As `kinds.roofline.rates.measure` returns them. Counted is the smallest table that holds the
        working set, or the largest one where none does.
    size : float
    threads : int
        All gather at a time.
    """
    table = sorted(
        (r["bytes"], r["ns_element"])
        for r in rates
        if r["kind"] == "gather" and r["threads"] == threads
    )
    return float(next((ns for held, ns in table if held >= size), table[-1][1]))


def far_ns(rates: Sequence[Mapping[str, Any]], row: Mapping[str, Any], structure: str) -> float:
    """Return what the gathers from a structure would take alone, at random places, ns per ray.

    The first of the elements that lie side by side is gathered at the rate of the working set, the
    others at the fastest rate of all.
    """
    threads = int(row["threads"])
    there = ns_element(rates, float(row[f"{structure}_bytes"]), threads)
    places, numbers = float(row[f"{structure}_places"]), float(row[f"{structure}_gathered"])
    return (places * there + (numbers - places) * _fastest(rates, threads)) / float(row["rays"])


def far_gathers_ns(rates: Sequence[Mapping[str, Any]], row: Mapping[str, Any]) -> float:
    """Return what all gathers would take alone, at random places, ns per ray."""
    return sum(far_ns(rates, row, structure) for structure in STRUCTURES)


def near_gathers_ns(rates: Sequence[Mapping[str, Any]], row: Mapping[str, Any]) -> float:
    """Return what the gathers would take at the fastest rate of all, ns per ray: a lower bound.

    The march's own slots are left out, which are a matter of how its work is put in order.
    """
    numbers = sum(float(row[f"{name}_gathered"]) for name in STRUCTURES if name != "slots")
    return numbers * _fastest(rates, int(row["threads"])) / float(row["rays"])


def _fastest(rates: Sequence[Mapping[str, Any]], threads: int) -> float:
    return min(ns_element(rates, rate["bytes"], threads) for rate in rates)
