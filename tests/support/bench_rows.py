"""Rows of results made up for tests of reports."""

import math

import numpy as np

ENVIRONMENT = {
    "cpu": "a CPU", "threads": 2, "os": "an OS", "embree": {"version": "4"},
    "packages": {"numba": "0"}, "git": None,
}  # fmt: skip

NOTHING = {float: math.nan, int: 0, bool: False, str: "", list: [], dict: {}}


def whole(schema, table, row):
    """Return a row with all columns of a table: what it does not say is 0, NaN or empty."""
    columns = {
        name: column
        for name, column in schema.tables[table].items()
        if not column.optional and name not in schema.key_names
    }
    return {**{name: NOTHING[column.type] for name, column in columns.items()}, **row}


def paper_cell(camera, rounds=2):
    """Return what `RunWriter.add_cell` takes of a cell of kind "paper": small, and whole."""
    from hybrid_rt_bench.kinds.paper.columns import SCHEMA, STAGES
    from hybrid_rt_bench.results.schema import HYBRID_STAGES

    samples = [
        {
            "technique": "paper" if stage in HYBRID_STAGES else "", "stage": stage, "round": k,
            "seconds": 0.01 * (1 + k), "phase": "measured",
        }
        for stage in STAGES
        for k in range(rounds)
    ]  # fmt: skip
    row = {
        name: 1.0
        for name, column in SCHEMA.tables["results"].items()
        if column.type is float and name not in SCHEMA.key_names
    }
    row |= {"technique": "paper", "rays": 1000, "resolved": 400, "alpha": 0.4, "rounds": rounds}
    row |= {"embree_path": "run", "embree_primary_path": "run"}
    verdicts = [{"technique": "paper", "status": "HIT", "verdict": "CORRECT", "count": 400}]
    picture = {
        "shaded": np.full((9, 16, 3), 128, np.uint8),
        "grey_paper": np.full((9, 16), 99, np.uint8),
        "classes_paper": (np.arange(144) % 4).reshape(9, 16).astype(np.uint8),
    }
    cell = {"scene": "hall", "camera": camera, "width": 640, "height": 360}
    return cell, samples, [whole(SCHEMA, "results", row)], verdicts, picture


def paper_run(out):
    """Return a writer of a run of kind "paper" without a cell."""
    from hybrid_rt_bench.experiments import load_experiment
    from hybrid_rt_bench.kinds.paper.columns import SCHEMA
    from hybrid_rt_bench.results.folder import create_run

    meta = {
        "kind": "paper", "command": [], "notes": ["a note"], "warnings": [],
        "spec": load_experiment("paper").model_dump(mode="json", by_alias=True),
        "scenes": [{"name": "hall", "row": "Sponza", "builtin": True, "triangles": 1000}],
        "environment": ENVIRONMENT,
    }  # fmt: skip
    return create_run(out, "paper", SCHEMA, meta)
