"""The palette: colours that are told apart with every common colour vision."""

import itertools

import numpy as np
import pytest
from colorspacious import cspace_convert

from hybrid_rt_bench.report import looks
from hybrid_rt_bench.report.looks import rgb

VISIONS = [None, "deuteranomaly", "protanomaly", "tritanomaly"]
LEAST = 10
"""The smallest distance in CAM02-UCS, where about 1 is just seen between patches side by side."""

GREYS = [f"#{v:02X}{v:02X}{v:02X}" for v in range(looks.GREYS[0], looks.GREYS[1] + 1, 4)]


def seen(colours, vision):
    """Return colours as they are seen with a colour vision at its full severity, CAM02-UCS."""
    values = np.array([rgb(colour) for colour in colours]) / 255
    if vision is not None:
        space = {"name": "sRGB1+CVD", "cvd_type": vision, "severity": 100}
        values = np.clip(cspace_convert(values, space, "sRGB1"), 0, 1)
    return cspace_convert(values, "sRGB1", "CAM02-UCS")


def nearest(colours, vision):
    """Return the smallest distance between two colours, and which they are."""
    places = seen(colours, vision)
    pairs = itertools.combinations(range(len(colours)), 2)
    return min((np.linalg.norm(places[i] - places[j]), colours[i], colours[j]) for i, j in pairs)


@pytest.mark.parametrize("vision", VISIONS)
@pytest.mark.parametrize(
    "colours",
    [
        [look.colour for look in looks.TECHNIQUES.values()]
        + list(dict.fromkeys(look.colour for look in looks.OUTSIDE)),
        [look.colour for look in looks.SERIES],
        [look.colour for look in looks.STAGES.values()],
        list(looks.STATUSES.values()),
        list(looks.VERDICTS.values()),
    ],
    ids=["techniques", "series", "stages", "statuses", "verdicts"],
)
def test_any_two_colours_side_by_side_are_told_apart(colours, vision):
    distance, one, other = nearest(colours, vision)
    assert distance > LEAST, f"{one} and {other}"


@pytest.mark.parametrize("vision", VISIONS)
def test_colours_of_verdicts_stand_out_of_the_greys(vision):
    verdicts = seen(list(looks.VERDICTS.values()), vision)
    greys = seen(GREYS, vision)
    assert np.linalg.norm(verdicts[:, None] - greys, axis=2).min() > LEAST


def test_red_and_green_of_old_would_not_have_passed():
    assert nearest(["#B2182B", "#1B7837", "#8C564B"], "deuteranomaly")[0] < LEAST


def test_markers_and_hatches_double_the_colours():
    known = list(looks.TECHNIQUES.values())
    assert len({look.marker for look in known + list(looks.OUTSIDE)}) == len(known) + 4
    marching = [look.hatch for name, look in looks.TECHNIQUES.items() if name != "embree"]
    assert len(set(marching + [look.hatch for look in looks.OUTSIDE])) == len(marching) + 4
    assert len({look.marker for look in looks.SERIES}) == len(looks.SERIES)


def test_a_technique_from_outside_takes_the_next_look_and_leaves_the_others_theirs():
    found = looks.looks(["mine", "paper", "yours", "certified"])
    assert found["paper"] == looks.TECHNIQUES["paper"]
    assert (found["mine"], found["yours"]) == looks.OUTSIDE[:2]
    many = [f"t{k}" for k in range(6)]
    assert looks.looks(many)["t4"] == looks.OUTSIDE[0]
