"""The table of generators that a scene definition may name."""

from __future__ import annotations

from collections.abc import Callable

import hybrid_rt as hrt
from hybrid_rt_scenes.atrium import atrium
from hybrid_rt_scenes.simple import cornell, sphere, stage
from hybrid_rt_scenes.street import street

GENERATORS: dict[str, Callable[..., hrt.Mesh]] = {
    "atrium": atrium,
    "cornell": cornell,
    "sphere": sphere,
    "stage": stage,
    "street": street,
}
