"""Arrays without a count of references."""

import sys

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from hybrid_rt.kernels._borrow import borrowed, keep


@njit
def squares(n):
    owner = np.empty(n)
    view = borrowed(owner)
    for i in range(n):
        view[i] = i * i
    total = view[1:].sum() + view.reshape(-1, 1)[0, 0]
    keep(owner)
    return total


@njit
def through(values):
    lent = borrowed(values)
    lent[0] = 7.0
    return lent.size


def test_a_borrowed_array_is_the_same_memory():
    assert squares(1000) == sum(i * i for i in range(1000))
    values = np.zeros(5)
    before = sys.getrefcount(values)
    assert through(values) == 5
    assert values[0] == 7.0
    assert sys.getrefcount(values) == before


def test_only_arrays_can_be_borrowed():
    with pytest.raises(TypingError, match="borrowed: array must be an array"):
        njit(lambda: borrowed(3))()
