"""The columns of the results of kind "frame": a row is a technique on one kind of rays."""

from __future__ import annotations

from hybrid_rt_bench.results.schema import VIEW, Column, Schema, count, flag, text

WRONG = ("false_hit", "false_miss")
"""The verdicts that make an answer wrong."""
UNJUDGED = "UNJUDGED"
"""The verdict on what is answered where there is no mesh to hold it against."""
NOWHERE = 255
"""Of a map of statuses: no ray starts in the pixel."""

SCHEMA = Schema(
    keys=(*VIEW, text("workload", "Which rays; see `hybrid-rt list`")),
    results=(
        text("technique", "Name of the technique, with its default parameters"),
        flag("judged", "Whether answers were held against the mesh"),
        count("rays", "Rays of the frame"),
        count("resolved", "Rays that the screen answers", better="higher"),
        count("hits", "Of them: with a hit"),
        *(
            count(name, f"Of the resolved rays: {name.replace('_', ' ')}", better="lower")
            for name in (*WRONG, "wrong_primitive")
        ),
        Column("alpha", "Share of rays that the screen answers", better="higher"),
        Column(
            "wrong_rate", "Share of false hits and misses among the resolved rays", better="lower"
        ),
        Column("wrong_low", "Lower end of the 95 % interval of wrong_rate"),
        Column("wrong_high", "Upper end of the 95 % interval of wrong_rate"),
        Column("steps", "Samples of the screen, all rays together", better="lower"),
    ),
    verdicts=(
        text("technique", "Name of the technique"),
        text("status", "How the march ended"),
        text("verdict", "What the judge says"),
        count("count", "Rays"),
    ),
    meta=(Column("frame", "The depth buffer, and how it was read", type=dict),),
)
