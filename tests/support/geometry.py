"""Whether the texts and legends of a figure lie inside of it and clear of each other."""

from dataclasses import dataclass

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.legend import Legend

SLACK = 0.75
"""What boxes may share, pixels: a box is a little larger than what is drawn in it."""


@dataclass(frozen=True)
class Piece:
    """Something that nothing may cover: a text or the frame of a legend."""

    name: str
    corners: np.ndarray
    owner: object


def check(figure):
    """Assert that every text and legend of a figure is whole, and that none covers another."""
    faults = problems(figure)
    assert not faults, "\n".join(faults)


def problems(figure):
    """Return what is wrong with the texts and legends of a figure, a line each."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    texts, legends = pieces(figure, renderer)
    assert texts, "a figure without a word"
    width, height = figure.bbox.size
    faults = [
        f"{piece.name} is cut off"
        for piece in texts + legends
        if (piece.corners < -SLACK).any() or (piece.corners > np.add((width, height), SLACK)).any()
    ]
    for k, one in enumerate(texts):
        faults += [f"{one.name} over {other.name}" for other in texts[k + 1 :] if meet(one, other)]
    for legend in legends:
        others = [p for p in texts + legends if p.owner is not legend.owner]
        faults += [f"{legend.name} over {other.name}" for other in others if meet(legend, other)]
    for ax in figure.axes:
        if ax.axison and ax.get_visible():
            ground = Piece(f"the panel {ax.get_title()!r}", box(ax.patch, renderer), ax)
            foreign = [p for p in texts + legends if p.owner is not ax and not inside(p.owner, ax)]
            faults += [f"{p.name} over {ground.name}" for p in foreign if meet(ground, p)]
    return faults


def pieces(figure, renderer):
    """Return every text that is drawn, and every legend."""
    legends = [artist for artist in figure.findobj(Legend) if artist.get_visible()]
    texts, seen = [], set()

    def add(text, owner):
        if id(text) in seen or not text.get_visible() or not text.get_text().strip():
            return
        seen.add(id(text))
        texts.append(Piece(repr(text.get_text()), turned(text, renderer), owner))

    for legend in legends:
        for text in (legend.get_title(), *legend.get_texts()):
            add(text, legend)
    own = [figure._suptitle, figure._supxlabel, figure._supylabel, *figure.texts]
    for text in own:
        if text is not None:
            add(text, figure)
    for ax in figure.axes:
        if not ax.get_visible():
            continue
        for text in ax.texts:
            add(text, ax)
        if ax.axison or ax.get_title():
            for text in (ax.title, ax._left_title, ax._right_title):
                add(text, ax)
        if ax.axison:
            for axis in (ax.xaxis, ax.yaxis):
                add(axis.label, ax)
                add(axis.offsetText, ax)
                for tick in axis._update_ticks():  # those that are drawn
                    add(tick.label1, ax)
                    add(tick.label2, ax)
    frames = [Piece("the legend", box(legend, renderer), legend) for legend in legends]
    return texts, frames


def inside(owner, ax):
    """Tell whether something belongs to a panel: it is its legend."""
    return owner is not None and owner is ax.get_legend()


def box(artist, renderer):
    extent = artist.get_window_extent(renderer)
    return np.array([(extent.x0, extent.y0), (extent.x1, extent.y0),
                     (extent.x1, extent.y1), (extent.x0, extent.y1)])  # fmt: skip


def turned(text, renderer):
    """Return the corners of a text's box, turned as it is, in pixels."""
    upright = text.get_window_extent(renderer)
    angle = text.get_rotation()
    if angle % 90 == 0:
        return box(text, renderer)
    text.set_rotation(0)
    level = text.get_window_extent(renderer)
    text.set_rotation(angle)
    centre = np.array([(upright.x0 + upright.x1) / 2, (upright.y0 + upright.y1) / 2])
    half = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * (level.width / 2, level.height / 2)
    cos, sin = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return centre + half @ np.array([(cos, sin), (-sin, cos)])


def meet(one, other):
    """Tell whether two convex boxes share more than `SLACK`: no line parts them."""
    a, b = one.corners, other.corners
    for corners in (a, b):
        for edge in np.diff(corners[:3], axis=0):
            length = np.hypot(*edge)
            if length == 0:
                return False
            across = np.array([-edge[1], edge[0]]) / length
            p, q = a @ across, b @ across
            if p.max() - SLACK <= q.min() or q.max() - SLACK <= p.min():
                return False
    return True
