"""The columns of the results of kinds that judge every answer.

A row is one point of a technique (its parameters) on the rays of one cell.
"""

from __future__ import annotations

from hybrid_rt_bench.results.schema import (
    HYBRID_STAGES,
    VIEW,
    Column,
    Schema,
    count,
    estimate,
    flag,
    text,
)

EMBREE = "embree"
"""The technique of the rows for Embree itself, at the points "default" and "robust"."""

CELL = ("scene", "camera", "width", "height", "workload", "seed")
"""Columns that say which rays a row is of."""

POINT = ("technique", "point")
"""Columns that say what answered them."""

WRONG = ("false_hit", "false_miss")
"""The verdicts that make an answer wrong."""

STRICT = (*WRONG, "wrong_primitive")
"""What a certified answer never is."""

VERDICTS = (*STRICT, "tie", "reference_wrong")
"""The verdicts that results count, of the resolved rays and, prefixed ``all_``, of all rays."""

T_ERRORS = ("error_t_p50", "error_t_p99", "error_t_max")
"""Columns for the error of t of claimed hits."""

PREPARED = ("prepare_ms", "prepare_mib", "lists_mib", "tests")
"""Columns for what a march needs that Embree does not."""

MAP_CLASSES = {
    "background": 0,
    "right": 1,
    "unresolved": 2,
    "false_hit": 3,
    "false_miss": 4,
    "wrong_primitive": 5,
}
"""What the pixels of an error map say."""

_POINT = (text("technique", "Name of the technique"), text("point", "Its parameters in words"))

SCHEMA = Schema(
    keys=(
        *VIEW,
        text("workload", "Which rays; see `hybrid-rt list`"),
        count("seed", "Which set of these rays"),
    ),
    results=(
        *_POINT,
        flag("default", "Whether these are the technique's default parameters"),
        count("rays", "Rays of the cell"),
        count("resolved", "Rays that the screen answers", better="higher"),
        *(
            count(
                f"{prefix}{name}",
                f"Number of {whom}: {name.replace('_', ' ')}",
                better="lower" if name in STRICT else "",
            )
            for prefix, whom in (("", "the resolved rays"), ("all_", "all rays of the hybrid"))
            for name in VERDICTS
        ),
        Column("alpha", "Share of rays that the screen answers", better="higher"),
        Column(
            "wrong_rate", "Share of false hits and misses among the resolved rays", better="lower"
        ),
        Column("wrong_low", "Lower end of the 95 % interval of wrong_rate"),
        Column("wrong_high", "Upper end of the 95 % interval of wrong_rate"),
        *(
            Column(name, f"Error of t over the true t of claimed hits, {name[8:]}", better="lower")
            for name in T_ERRORS
        ),
        Column("steps", "Samples of the screen, all rays together", better="lower"),
        Column("prepare_ms", "Making what the march reads, once per view", "ms", "lower"),
        Column("prepare_mib", "Memory of what the march reads", "MiB", "lower"),
        Column("lists_mib", "Memory of the lists of primitives in it", "MiB", "lower"),
        Column("tests", "Exact tests, all rays together", better="lower"),
        Column(
            "flip", "FLIP error of the image of the reflections, 0 to 1", "", "lower", optional=True
        ),
        Column(
            "rmse",
            "Root of the mean squared error of that image, 0 to 1",
            "",
            "lower",
            optional=True,
        ),
        flag("timed", "Whether it was timed"),
        *(
            Column(f"{stage}_ms", f"Median time: {label}", "ms", "lower")
            for stage, label in (
                *((stage, stage) for stage in HYBRID_STAGES),
                ("hybrid", "hybrid, its four stages"),
                ("embree", "the strongest Embree beside it, every ray"),
            )
        ),
        *estimate("speedup", "Time of Embree over that of the hybrid beside it", "", "higher"),
    ),
    samples=(
        *_POINT,
        count("round", "Number of the round"),
        Column("embree", "Time of the strongest Embree beside it, every ray", "s", "lower"),
        *(
            Column(stage, f"Time of {stage}", "s", "lower", optional=True)
            for stage in HYBRID_STAGES
        ),
        Column("hybrid", "Time of the hybrid's four stages; of Embree, the whole", "s", "lower"),
    ),
    verdicts=(
        *_POINT,
        text("status", "How the march ended"),
        text("verdict", "What the judge says"),
        count("count", "Rays"),
    ),
    meta=(Column("scenes", "The scenes that were loaded", type=list),),
)
