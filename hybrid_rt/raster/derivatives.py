"""Derivatives of a depth buffer whose surfaces nobody knows."""

from __future__ import annotations

import numpy as np

from hybrid_rt.kernels.arrays import F64, Bool

SPANS = (8, 4, 2, 1)
"""Pixels to one side that a line may run through."""
MARGIN = max(SPANS)
ROWS = 16
STEP = 0.5
"""A difference is a step between two surfaces if the next one is so much smaller."""


def differences(depth: F64, slack: F64) -> tuple[F64, F64]:
    """Return the change of depth for one pixel to the right and for one pixel down.

    Parameters
    ----------
    depth : (H, W) float64
        Of the screen, 0 where there is nothing: linear over what is flat.
    slack : (H, W) float64
        By how much each depth may be off.

    Returns
    -------
    ddx, ddy : (H, W) float64
        0 where there is nothing.

    Notes
    -----
    Along each axis the slope is that of the longest line of pixels, up to 8 to one side or to both,
    whose depths lie on one line within twice their slack: what a buffer of few bits has rounded
    away is averaged out again, over flat surfaces only. A line never bridges a silhouette that can
    be told from the slack. Where no such line is found, as on small or curved triangles, it is the
    difference to the left or to the right neighbour: to that from whose side two pixels foretell
    this one better, and without two, the smaller difference. One that is twice the next on its side
    is a step to another surface: the pixel is alone on its own, and its slope is taken as 0.

    References
    ----------
    J. Turánszki, "Improved normal reconstruction from depth", wickedengine.net, 2019, for the
    smaller difference; "Accurate normal reconstruction from depth buffer", atyuwen.github.io, 2021,
    for the side that foretells.
    """
    ddx = _along_rows(depth, slack)
    ddy = _along_rows(np.ascontiguousarray(depth.T), np.ascontiguousarray(slack.T)).T
    return ddx, np.ascontiguousarray(ddy)


def _along_rows(depth: F64, slack: F64) -> F64:
    """Return the slopes along rows, some rows at a time, which a cache holds."""
    slopes = np.empty_like(depth)
    for first in range(0, len(depth), ROWS):
        rows = slice(first, first + ROWS)
        slopes[rows] = _of_rows(depth[rows], slack[rows])
    return slopes


def _of_rows(depth: F64, slack: F64) -> F64:
    line = _Line(depth, slack)
    slope = line.nearest()
    open_ = depth > 0.0
    for span in SPANS:
        # Of two lines as long as each other the one through both sides comes first.
        found, both = line.through(-span, span)
        _take(slope, open_, found, both)
        if span > 1:
            left, to_left = line.through(-span, 0)
            right, to_right = line.through(0, span)
            smaller = to_left & (~to_right | (np.abs(left) <= np.abs(right)))
            _take(slope, open_, np.where(smaller, left, right), to_left | to_right)
    slope[depth <= 0.0] = 0.0
    return slope


def _take(slope: F64, open_: Bool, found: F64, fits: Bool) -> None:
    """Write the slopes that were found first, and leave the others open."""
    here = open_ & fits
    slope[here] = found[here]
    open_ &= ~here


class _Line:
    """Rows of depths with room beside them, so that neighbours are slices."""

    def __init__(self, depth: F64, slack: F64) -> None:
        pad = ((0, 0), (MARGIN, MARGIN))
        self._depth, self._slack = np.pad(depth, pad), np.pad(slack, pad)
        self._width = depth.shape[1]

    def at(self, offset: int) -> F64:
        """Return the depths so many pixels to the right."""
        return self._depth[:, MARGIN + offset : MARGIN + offset + self._width]

    def through(self, first: int, last: int) -> tuple[F64, Bool]:
        """Return the slope from one offset to the other, and where all between lies on it."""
        start, end = self.at(first), self.at(last)
        slope = (end - start) / (last - first)
        fits = (start > 0.0) & (end > 0.0)
        for offset in range(first + 1, last):
            here = self.at(offset)
            off = np.abs(here - (start + (offset - first) * slope))
            slack = self._slack[:, MARGIN + offset : MARGIN + offset + self._width]
            fits &= (here > 0.0) & (off <= 2.0 * slack)
        return slope, fits

    def nearest(self) -> F64:
        """Return the difference to one neighbour; 0 where there is none on the same surface."""
        here, left, right = self.at(0), self.at(-1), self.at(1)
        to_left, to_right = here - left, right - here
        off_left = np.where(self.at(-2) > 0.0, np.abs(to_left - (left - self.at(-2))), np.inf)
        off_right = np.where(self.at(2) > 0.0, np.abs((self.at(2) - right) - to_right), np.inf)
        both = np.isfinite(off_left) & np.isfinite(off_right)
        smaller = np.abs(to_left) <= np.abs(to_right)
        use_left = np.where(both, off_left <= off_right, smaller)
        use_left = (use_left & (left > 0.0)) | (right <= 0.0)
        slope = np.where(use_left, to_left, to_right)
        second = np.where(use_left, self.at(-2), self.at(2))
        beyond = np.where(use_left, left - second, second - right)
        step = (second > 0.0) & (np.abs(beyond) < STEP * np.abs(slope))
        return np.where(((left > 0.0) | (right > 0.0)) & ~step, slope, 0.0)
