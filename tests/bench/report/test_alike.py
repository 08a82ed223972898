"""Like compared with like, on frames worked out by hand."""

import pandas as pd
import pytest

from hybrid_rt_bench.report.alike import alike


def rows(*cells):
    return pd.DataFrame(cells, columns=["technique", "scene", "camera"])


def kept(frame, **options):
    found = alike(frame, ["scene", "camera"], **options)
    return [tuple(row) for row in found.itertuples(index=False)]


def test_only_the_cells_that_all_have_are_kept():
    frame = rows(("a", "s", "1"), ("a", "s", "2"), ("b", "s", "2"), ("b", "s", "3"))
    assert kept(frame) == [("a", "s", "2"), ("b", "s", "2")]


def test_what_shares_no_cell_is_left_out_and_makes_no_other_smaller():
    frame = rows(("a", "s", "1"), ("a", "s", "2"), ("b", "s", "1"), ("b", "s", "2"),
                 ("c", "s", "9"))  # fmt: skip
    assert kept(frame) == [("a", "s", "1"), ("a", "s", "2"), ("b", "s", "1"), ("b", "s", "2")]


def test_groups_are_compared_each_by_itself():
    frame = rows(("a", "s", "1"), ("b", "s", "1"), ("a", "t", "1"), ("a", "t", "2"))
    assert kept(frame, group=["scene"]) == [tuple(row) for row in frame.itertuples(index=False)]


@pytest.mark.parametrize("group", [(), ("scene",)])
def test_nothing_and_one_technique_stay_as_they_are(group):
    assert kept(rows(), group=group) == []
    frame = rows(("a", "s", "1"), ("a", "t", "1"))
    assert kept(frame, group=group) == [("a", "s", "1"), ("a", "t", "1")]
