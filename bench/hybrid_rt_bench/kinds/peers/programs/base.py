"""What a peer is: another program that answers the same rays, or draws the same picture.

Every peer is optional. Its module imports the peer's package where the peer is opened and nowhere
else, so that all of this can be imported, checked and tested without any of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hybrid_rt as hrt
from hybrid_rt_bench.measure.environment import version_of


class PeerError(hrt.HybridRTError):
    """A peer that is there and cannot do what is asked of it; the message says why."""


@dataclass(frozen=True, eq=False)
class Answers:
    """What a peer says about rays.

    Attributes
    ----------
    t : (N,) float
        In units of the direction's length; infinity for a miss, NaN where the peer does not say.
    prim_id : (N,) int
        Index into ``scene.faces``; -1 for a miss.
    """

    t: NDArray[Any]
    prim_id: NDArray[Any]


@dataclass(frozen=True, eq=False)
class Query:
    """Rays in a peer's own arrays.

    Attributes
    ----------
    run : callable
        What is timed: traces all rays and returns when the peer's results are there, evaluated.
    answers : callable
        Brings what `run` returned to NumPy; not timed.
    label : str
        Which of the peer's ways is taken, if it has several.
    """

    run: Callable[[], Any]
    answers: Callable[[Any], Answers]
    label: str = ""


@dataclass(frozen=True, eq=False)
class View:
    """Rays that every peer is asked about.

    Attributes
    ----------
    workload : str
        "mirror" or "primary".
    rays : Rays
    gbuffer : GBuffer, optional
        On whose visible surfaces the rays start; None for primary rays.
    tracer : EmbreeTracer, optional
        The strongest Embree for these rays.
    label : str
        Its path.
    """

    workload: str
    rays: hrt.Rays
    gbuffer: hrt.GBuffer | None = None
    tracer: hrt.EmbreeTracer | None = None
    label: str = ""


@dataclass(frozen=True, eq=False)
class Picture:
    """What a raster peer draws.

    Attributes
    ----------
    depth : (H, W) float32
        ``near / z_view``, 0 where there is nothing; row 0 is the top.
    prim_id : (H, W) int32
        -1 where there is nothing.
    """

    depth: NDArray[np.float32]
    prim_id: NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Drawing:
    """A picture of one camera, ready to be drawn.

    Attributes
    ----------
    draw : callable
        Timed: clears, draws everything and returns when it is drawn.
    read : callable
        Timed apart: returns the `Picture` as NumPy arrays.
    """

    draw: Callable[[], Any]
    read: Callable[[], Picture]


class Opened:
    """A peer with a scene in it.

    Attributes
    ----------
    build_seconds : float
        From the scene's arrays to the first answered ray, without importing the peer.
    threads : int
        Threads that it traces or draws with.
    detail : str
        What else is to be known of it: the backend of a library, the renderer of a driver.
    """

    build_seconds: float = float("nan")
    threads: int = 1
    detail: str = ""

    def load(self, view: View) -> Query | None:
        """Return the rays of a view in the peer's arrays, None for rays that it has no answer to.

        What this does is not timed as tracing.
        """
        raise NotImplementedError

    def draw(self, camera: hrt.Camera) -> Drawing:
        """Return the picture of a camera, for a peer that draws."""
        raise NotImplementedError

    def close(self) -> None:
        """Let go of what the scene takes."""


@dataclass(frozen=True)
class Peer:
    """A program to compare with.

    Attributes
    ----------
    name : str
    description : str
    packages : tuple of str
        Distributions whose versions are told; none for what is ours.
    open : callable
        Takes a scene and a number of threads; raises whatever keeps the peer from running.
    raster : bool
        Whether it draws pictures and does not trace rays.
    sampled : bool
        Whether it is so slow that it gets only some of the rays.
    alone : bool
        Whether it is tried first in a process of its own, with a limit of time: what crashes or
        never ends there does not cost the run, and its peak memory can be told.
    """

    name: str
    description: str
    packages: tuple[str, ...]
    open: Callable[[hrt.Scene, int], Opened]
    raster: bool = False
    sampled: bool = False
    alone: bool = True

    @property
    def version(self) -> str:
        """The versions of its packages, without importing any."""
        return ", ".join(f"{name} {version_of(name)}" for name in self.packages) or (
            f"hybrid-rt {hrt.__version__}"
        )


def joined(rays: hrt.Rays) -> NDArray[np.float32]:
    """Return origins and directions side by side, (N, 6) float32."""
    return np.concatenate([rays.origin, rays.direction], axis=1)


def answers_of(n: int, hit: NDArray[Any], t: NDArray[Any], prim_id: NDArray[Any]) -> Answers:
    """Return answers to `n` rays from an index of those that hit, and what they hit."""
    found = Answers(np.full(n, np.inf), np.full(n, -1, np.int64))
    found.t[hit] = t
    found.prim_id[hit] = prim_id
    return found
