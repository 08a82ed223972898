"""The columns of the results of kind "stability"."""

from __future__ import annotations

from hybrid_rt_bench.results.schema import Better, Schema, count, flag, text

BETTER: dict[str, Better] = {"correct": "higher", "tie": ""}

SCHEMA = Schema(
    keys=(text("case", "Name of the hard case"),),
    results=(
        text("technique", "Name of the technique, or of the tracer"),
        text("state", "One of pass, fail and error"),
        flag("exact", "Whether it is held to exact answers"),
        count("rays", "Rays of the case"),
        count("unresolved", "Rays without an answer", better="lower"),
        *(
            count(name, meaning, better=BETTER.get(name, "lower"))
            for name, meaning in {
                "correct": "Right answers",
                "tie": "Another primitive as near as the true one",
                "false_hit": "Hits more than a pixel from the truth",
                "false_miss": "Rays said to hit nothing that do",
                "wrong_primitive": "Another triangle within a pixel of the truth",
                "imprecise": "Distances off by more than float32 must be",
                "false_free": "Hand-over distances beyond the true hit",
                "wrong": "Rays that fail the case",
            }.items()
        ),
        text("first", "The first wrong rays of every sort, as JSON"),
        text("error", "What it raised; empty if it did not"),
    ),
    cell=(
        text("what_goes_wrong", "What the case is about"),
        count("rays", "Rays of the case"),
        count("triangles", "Triangles of its scene"),
        count("hits", "Rays that truly hit something"),
        count("ambiguous", "Rays whose answer float32 cannot tell"),
    ),
)
