"""How far an image is from the one it should be.

FLIP is the difference that a viewer would notice when the two images are shown in turn:
P. Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG 2020, as its
authors' own package computes it, at its default viewing distance.
"""

from __future__ import annotations

import flip_evaluator
import numpy as np
from numpy.typing import NDArray


def columns(reference: NDArray[np.float32], image: NDArray[np.float32]) -> dict[str, float]:
    """Return the mean FLIP error and the root of the mean squared error.

    Parameters
    ----------
    reference, image : (H, W, 3) float32, sRGB in 0 to 1
    """
    difference = reference.astype(np.float64) - image
    _, flip, _ = flip_evaluator.evaluate(reference, image, "LDR", applyMagma=False)
    return {"flip": float(flip), "rmse": float(np.sqrt(np.mean(difference**2)))}
