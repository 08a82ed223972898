"""Rows of results made up for tests of reports."""

import math

ENVIRONMENT = {
    "cpu": "a CPU", "threads": 2, "os": "an OS", "embree": {"version": "4"},
    "packages": {"numba": "0"}, "git": None, "threading_layer": "omp",
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
