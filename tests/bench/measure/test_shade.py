"""Light as sRGB says it, against the values of IEC 61966-2-1."""

import numpy as np
import pytest

from hybrid_rt_bench.measure.shade import srgb


@pytest.mark.parametrize(
    ("linear", "encoded"),
    [
        (0.0, 0.0),
        (0.001, 0.01292),
        (0.0031308, 0.04045),  # where the two pieces meet
        (0.01, 0.099853),
        (0.18, 0.461356),  # the grey card
        (0.214041, 0.5),
        (0.5, 0.735357),
        (1.0, 1.0),
    ],
)
def test_known_values(linear, encoded):
    assert srgb(np.float32(linear)) == pytest.approx(encoded, abs=2e-6)


def test_it_is_the_inverse_of_the_standards_other_direction():
    v = np.linspace(0, 1, 4096)
    linear = np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)
    assert np.abs(srgb(linear.astype(np.float32)) - v).max() < 2e-6


def test_bytes_come_back_as_they_were():
    v = np.arange(256) / 255
    linear = np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)
    assert (np.round(255 * srgb(linear.astype(np.float32))) == np.arange(256)).all()
    assert srgb(linear.astype(np.float32)).dtype == np.float32
