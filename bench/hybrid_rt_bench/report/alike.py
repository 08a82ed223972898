"""Compare like with like: pool what several techniques were all measured on, and nothing else."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from hybrid_rt_bench.report.looks import GREY

MISSING = "not measured"


def alike(
    rows: pd.DataFrame, cells: Sequence[str], group: Sequence[str] = (), of: str = "technique"
) -> pd.DataFrame:
    """Return the rows of the cells that all techniques have in common.

    Parameters
    ----------
    rows : DataFrame
    cells : sequence of str
        The columns that say which cell a row is of.
    group : sequence of str
        Rows are pooled for each value of these columns, and compared inside of it alone.
    of : str
        The column of what is compared.

    Returns
    -------
    DataFrame
        In each group, what has no cell in common with the others is left out, beginning with what
        has the fewest cells: it is shown as missing, and no other is made smaller for it.
    """
    if rows.empty:
        return rows
    key = pd.Series(list(zip(*(rows[name] for name in cells), strict=True)), index=rows.index)
    kept = []
    groups = [part for _, part in rows.groupby(list(group), sort=False)] if group else [rows]
    for part in groups:
        sets = {name: set(key[mine.index]) for name, mine in part.groupby(of, sort=False)}
        while len(sets) > 1 and not set.intersection(*sets.values()):
            del sets[min(reversed(list(sets)), key=lambda name: len(sets[name]))]
        common = set.intersection(*sets.values())
        mine = key[part.index].isin(common) & part[of].isin(list(sets))
        kept += [i for i, keep in mine.items() if keep]
    return rows.loc[rows.index.isin(kept)]


def gap(ax: Axes, x: float, y: float, width: float, height: float, *, upright: bool) -> None:
    """Draw a hatched box with a word where a bar would be, in data coordinates along the bar.

    Parameters
    ----------
    ax : Axes
    x, y, width, height : float
        Where the bar would be: across it in data, along it as a share of the axis.
    upright : bool
        Whether bars go upwards.
    """
    transform = ax.get_xaxis_transform() if upright else ax.get_yaxis_transform()
    ax.add_patch(
        Rectangle(
            (x, y), width, height, transform=transform, fill=False, edgecolor="#BBBBBB",
            hatch="////", lw=0.6, zorder=1.5,
        )
    )  # fmt: skip
    ax.text(
        x + width / 2, y + height / 2, MISSING, transform=transform, ha="center", va="center",
        rotation=90 if upright else 0, fontsize=7, color=GREY, zorder=1.6,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8},
    )  # fmt: skip
