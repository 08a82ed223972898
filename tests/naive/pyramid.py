"""The depth pyramid, cell by cell from the pixels themselves."""

import numpy as np


def pyramid(depth):
    """Return the list of levels (h, w): each cell is the nearest of the pixels below it."""
    height, width = depth.shape
    levels = []
    level = 0
    while True:
        size = 2**level
        w, h = -(-width // size), -(-height // size)
        cells = np.empty((h, w), depth.dtype)
        for y in range(h):
            for x in range(w):
                block = depth[y * size : (y + 1) * size, x * size : (x + 1) * size]
                cells[y, x] = max(block.ravel().tolist())
        levels.append(cells)
        if (w, h) == (1, 1):
            return levels
        level += 1
