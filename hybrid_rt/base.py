"""The parts of the house: what a technique, a tracer and a screen are.

Whatever makes a G-buffer is a view. Whatever reads a screen is a technique. Whatever answers any
ray is a tracer. The hybrid asks a technique first and a tracer for the rays that are unresolved.

A *view* is a `GBuffer`: depths and primitives of one camera, by `rasterize` or from arrays.
A *technique* makes what it reads of a view once, the *screen* (`prepare`), and marches rays through
it (`march`). It declares what it reads, whether it is certified and what it can answer. A *tracer*
declares which queries it answers, and knows its scene.
"""

from __future__ import annotations

import abc
import time
from dataclasses import dataclass, fields
from typing import Any, ClassVar, NoReturn, Protocol, TypeVar

from hybrid_rt import _check, _threads
from hybrid_rt.camera.camera import Camera
from hybrid_rt.errors import ArgumentError
from hybrid_rt.kernels.arrays import I64, Bool
from hybrid_rt.raster.gbuffer import GBuffer
from hybrid_rt.rays.hits import Hits
from hybrid_rt.rays.marched import Marched
from hybrid_rt.rays.rays import Rays
from hybrid_rt.registry import Registry
from hybrid_rt.scene.mesh import Scene

NEAREST, ANY, ALL, CLOSEST_POINT = "nearest", "any", "all", "closest point"
QUERIES = (NEAREST, ANY, ALL, CLOSEST_POINT)
"""What can be asked of a tracer: the nearest hit, whether there is any, all hits; of a point."""

WHICH = ("all", "default", "switches", "cheapest")
"""Which points of a technique's grid; see `Technique.points`."""


class Tracer(Protocol):
    """Whatever answers any ray.

    Attributes
    ----------
    scene : Scene
        What is traced.
    queries : frozenset of str
        Which of `QUERIES` it answers.

    Notes
    -----
    If it has methods `intersect_into` and `occluded_into` like those of `EmbreeTracer`, the hybrid
    calls these: then no ray and no hit is copied. It is registered as a class with a `name`, which
    is called with a scene and `threads`.
    """

    @property
    def scene(self) -> Scene:
        """What is traced."""
        ...

    @property
    def queries(self) -> frozenset[str]:
        """Which of `QUERIES` it answers."""
        ...

    def intersect(self, rays: Rays) -> Hits:
        """Return the nearest hit of each ray."""
        ...

    def occluded(self, rays: Rays) -> Bool:
        """Return, as (N,) bool, whether each ray hits anything between its t_near and t_far."""
        ...


@dataclass(frozen=True)
class Point:
    """A technique with parameters that are worth trying, and what is said of them.

    Attributes
    ----------
    label : str
        Says the parameters; unique among the points of a technique.
    technique : Technique
    """

    label: str
    technique: Technique

    def __post_init__(self) -> None:
        _check.text("label", self.label)
        _check.instance("technique", self.technique, Technique)

    @property
    def name(self) -> str:
        """The technique's name."""
        return self.technique.name

    @property
    def default(self) -> bool:
        """Whether these are the technique's default parameters."""
        return self.technique == type(self.technique)()


class Screen:
    """What a technique reads of one view, made once by `prepare`.

    Attributes
    ----------
    technique : Technique
        What marches through it.
    gbuffer : GBuffer
        The view.
    data : object
        What the technique has made of it, such as a pyramid; None for nothing.
    seconds : float
        What making it took; with JIT compilation in a first call.
    """

    technique: Technique
    gbuffer: GBuffer
    data: Any
    seconds: float

    def __init__(self, *_: Any, **__: Any) -> None:
        raise ArgumentError("screen", "one that hybrid_rt.prepare has made", "parts of one")

    @classmethod
    def _made(cls, technique: Technique, gbuffer: GBuffer, data: Any, seconds: float) -> Screen:
        screen = object.__new__(cls)
        for name, value in (
            ("technique", technique), ("gbuffer", gbuffer), ("data", data), ("seconds", seconds),
        ):  # fmt: skip
            object.__setattr__(screen, name, value)
        return screen

    def __setattr__(self, name: str, value: Any) -> NoReturn:
        raise AttributeError(f"a screen does not change: {name}")

    __delattr__ = __setattr__  # type: ignore[assignment]

    @property
    def scene(self) -> Scene:
        """What is on the screen; refused by name where that is not known."""
        return self.gbuffer.known_scene

    @property
    def camera(self) -> Camera:
        """Whose pixels the screen has."""
        return self.gbuffer.camera

    @property
    def nbytes(self) -> int:
        """Bytes of `data`."""
        return int(getattr(self.data, "nbytes", 0))

    def of(self, technique: Technique) -> Screen:
        """Return the same screen for a technique that reads the same.

        Raises
        ------
        ArgumentError
            `technique` reads something else of a view.
        """
        if technique is self.technique:
            return self
        _check.instance("technique", technique, Technique)
        if type(technique).name != self.technique.name or technique.reads != self.technique.reads:
            expected = f"one that reads what {self.technique!r} reads"
            raise ArgumentError("technique", expected, repr(technique))
        return Screen._made(technique, self.gbuffer, self.data, self.seconds)

    def __repr__(self) -> str:
        camera = self.camera
        scene = self.gbuffer.scene
        of = "a depth buffer alone" if scene is None else repr(scene.name)
        return f"<screen of {of}, {camera.width} x {camera.height}, for {self.technique!r}>"


@dataclass(frozen=True)
class Technique(abc.ABC):
    """Whatever reads a screen: a frozen dataclass of parameters, each with a default.

    A technique of one's own gives `name` and `description`, `_march`, and `_read` if it reads more
    than the G-buffer; `docs/techniques.md` has a complete one. `register` makes it known by
    its name.

    Attributes
    ----------
    name : str
        By which it is known.
    description : str
        What it does, in a sentence.
    reference : str
        Who published it.
    certified : bool
        Whether every answer is proven.
    answers_misses : bool
        Whether it resolves rays to a miss, and not only to hits.
    """

    name: ClassVar[str]
    description: ClassVar[str]
    reference: ClassVar[str] = ""
    certified: ClassVar[bool] = False
    answers_misses: ClassVar[bool] = False

    @property
    def reads(self) -> tuple[Any, ...]:
        """What it reads besides the G-buffer: techniques of which this is equal share a screen."""
        return ()

    @property
    def hands_over(self) -> bool:
        """Whether a tracer may start where `Marched.t_free` ends: it is proven free up to there."""
        return False

    @classmethod
    def points(cls, which: str = "all") -> list[Point]:
        """Return parameters worth trying, in the order of a curve.

        Parameters
        ----------
        which : {"all", "default", "switches", "cheapest"}
            The whole grid, or the default alone. Of a technique that says so: one switch turned at
            a time, or the default and what gives up early; of others these are the default alone.
        """
        _check.choice("which", which, WHICH)
        grid = cls._grid(which)
        return grid if which != "default" else [point for point in grid if point.default]

    @classmethod
    def _grid(cls, which: str) -> list[Point]:
        """Return the points of `points`; for a technique to override."""
        return [Point("default", cls())]

    def prepare(self, gbuffer: GBuffer, *, threads: int | None = None) -> Screen:
        """Return what this technique reads of a view, made once; as `hybrid_rt.prepare`."""
        _check.instance("gbuffer", gbuffer, GBuffer)
        _threads.count(threads)
        start = time.perf_counter()
        data = self._read(gbuffer, threads)
        return Screen._made(self, gbuffer, data, time.perf_counter() - start)

    def march(
        self, rays: Rays, screen: Screen, *, any_hit: bool = False, threads: int | None = None
    ) -> Marched:
        """Return what the screen says about each ray; as `hybrid_rt.march`."""
        any_hit = _check.boolean("any_hit", any_hit)
        screen = self._checked(rays, screen, threads)
        scene = screen.gbuffer.scene
        marched = self._march(rays, screen, any_hit, threads)
        if type(self).__module__.partition(".")[0] == __package__:
            return marched
        _check.instance(f"what {self.name!r} returns", marched, Marched)
        camera = screen.camera
        size = len(rays), 1 if scene is None else len(scene), camera.width, camera.height
        return marched._checked(f"what {self.name!r} returns", *size)

    def steps_by_level(
        self, rays: Rays, screen: Screen, *, threads: int | None = None
    ) -> I64 | None:
        """Return how many samples all rays take of each level of a pyramid.

        Arguments and errors are those of `hybrid_rt.march`. The rays are marched once more, with
        counters, which a march does without.

        Returns
        -------
        (L,) int64, or None
            Level 0 is the depth buffer, and all that a technique without a pyramid reads. None of a
            technique that does not count them.
        """
        self._checked(rays, screen, threads)
        return None

    def _checked(self, rays: Rays, screen: Screen, threads: int | None) -> Screen:
        """Return the screen as this technique's, or raise unless the arguments fit each other."""
        _check.instance("rays", rays, Rays)
        _check.instance("screen", screen, Screen)
        _threads.count(threads)
        screen = screen.of(self)
        check_rays(rays, screen.gbuffer.scene, screen.camera)
        return screen

    def _read(self, gbuffer: GBuffer, threads: int | None) -> Any:
        """Return what `march` needs besides the G-buffer; for a technique to override."""
        return None

    @abc.abstractmethod
    def _march(self, rays: Rays, screen: Screen, any_hit: bool, threads: int | None) -> Marched:
        """Return what the screen says about each ray; rays and screen belong together."""

    def words(self) -> dict[str, str]:
        """Return the parameters in words."""
        return {field.name: _words(getattr(self, field.name)) for field in fields(self)}


def _words(value: Any) -> str:
    if value is None:
        return "no limit"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def prepare(gbuffer: GBuffer, technique: str | Technique, *, threads: int | None = None) -> Screen:
    """Return what a technique reads of a view, made once.

    Parameters
    ----------
    gbuffer : GBuffer
    technique : str or Technique
        A registered name, with its default parameters, or an object: ``Paper(samples=2)``.
    threads : int, optional
        Default: as many as Numba is set to.

    Returns
    -------
    Screen
        For `march`, `trace_hybrid` and `occluded_hybrid`, as often as wanted.

    Raises
    ------
    ArgumentError
        `gbuffer` is none, `technique` neither a name nor a technique, `threads` out of range.
    UnknownNameError
        A name that no technique has.
    """
    return named(technique).prepare(gbuffer, threads=threads)


def named(technique: str | Technique) -> Technique:
    """Return the technique that an argument says: itself, or the one of that name."""
    if isinstance(technique, str):
        return TECHNIQUES[technique]()
    if not isinstance(technique, Technique):
        names = ", ".join(repr(name) for name in TECHNIQUES)
        expected = f"one of {names}, or a technique"
        raise ArgumentError("technique", expected, _check.describe(technique))
    return technique


def march(
    rays: Rays, screen: Screen, *, any_hit: bool = False, threads: int | None = None
) -> Marched:
    """Return what the screen says about each ray, and for which rays it says nothing.

    Parameters
    ----------
    rays : Rays
        N rays, world. A ray whose `pixel` is the pixel it starts in is taken to start on the
        surface visible there.
    screen : Screen
        What a technique reads of a view; that technique marches.
    any_hit : bool
        Whether any hit answers a ray and not only its nearest. In all techniques but "certified"
        the first hit is the answer, and this changes nothing.
    threads : int, optional
        Default: as many as Numba is set to.

    Returns
    -------
    Marched
        N statuses and answers.

    Raises
    ------
    ArgumentError
        Rays that were made for another scene or another view; something that is no rays or no
        screen.

    Notes
    -----
    In "paper" free space is proven at pixel centres only, so a few answers are wrong by more than a
    pixel (``hybrid-rt run paper`` measures their share). "slope" proves it over whole pixels, but
    only for the planes that the pixels show. "linear", "dda" and "hiz" guess a thickness, and are
    wrong wherever it is; "hiz" also answers rays with a miss.

    The same bits come out for any number of threads and any order of the rays. Directions of any
    length give the same answers: they are scaled by powers of two.
    """
    _check.instance("screen", screen, Screen)
    return screen.technique.march(rays, screen, any_hit=any_hit, threads=threads)


def check_rays(rays: Rays, scene: Scene | None, camera: Camera | None = None) -> None:
    """Raise unless rays may be used with a scene, and with a view if one is given.

    Rays of any scene may be marched through a view of one that is not known.
    """
    if scene is not None and rays.scene is not None and not rays.scene.same_as(scene):
        raise ArgumentError(
            "rays",
            f"rays of scene {scene.name!r}, or of none (rays.detached())",
            f"rays of another scene, {rays.scene.name!r}",
        )
    if camera is not None and rays.camera is not None and rays.camera != camera:
        raise ArgumentError(
            "rays",
            "rays of the screen's view, or of none (rays.detached())",
            f"rays of {rays.camera}, on a screen of {camera}",
        )


def check_tracer(tracer: Any, scene: Scene, query: str, method: str) -> None:
    """Raise unless a tracer of this scene answers a query, by a method of that name."""
    traced = getattr(tracer, "scene", None)
    if not callable(getattr(tracer, method, None)) or not isinstance(traced, Scene):
        expected = f"a tracer: an object with a scene and a method {method}"
        raise ArgumentError("tracer", expected, _check.describe(tracer))
    if query not in getattr(tracer, "queries", QUERIES):
        raise ArgumentError("tracer", f"one that answers {query!r}", _check.describe(tracer))
    if not traced.same_as(scene):
        got = f"one of another scene, {traced.name!r}"
        raise ArgumentError("tracer", f"a tracer of scene {scene.name!r}, as the screen is", got)


class _Techniques(Registry[type[Technique]]):
    def check(self, thing: Any) -> None:
        if not (isinstance(thing, type) and issubclass(thing, Technique)):
            raise ArgumentError("technique", "a subclass of Technique", _check.describe(thing))
        for name in ("name", "description"):
            if not isinstance(getattr(thing, name, None), str):
                expected = f"a subclass of Technique with a {name}"
                raise ArgumentError("technique", expected, _check.describe(thing))
        try:
            thing()
        except TypeError as error:
            expected = "a technique that can be made without arguments"
            raise ArgumentError("technique", expected, f"{thing.__name__}: {error}") from error


class _Tracers(Registry[Any]):
    def check(self, thing: Any) -> None:
        if not (isinstance(thing, type) and callable(getattr(thing, "intersect", None))):
            expected = "a class with a method intersect"
            raise ArgumentError("tracer", expected, _check.describe(thing))


TECHNIQUES: Registry[type[Technique]] = _Techniques(
    "technique", "hybrid_rt.techniques", "hybrid_rt.techniques"
)
"""All techniques by name."""

TRACERS: Registry[Any] = _Tracers("tracer", "hybrid_rt.tracers", "hybrid_rt.trace")
"""All tracers by name, as classes that are called with a scene and `threads`."""

Registered = TypeVar("Registered")


def register(thing: Registered) -> Registered:
    """Make a technique or a tracer known by its `name`, and return it; also as a decorator.

    Parameters
    ----------
    thing : type
        A subclass of `Technique`, or a class with a method `intersect`.

    Raises
    ------
    ArgumentError
        Something else, or a name that is taken.
    """
    registry: Registry[Any] = (
        TECHNIQUES if isinstance(thing, type) and issubclass(thing, Technique) else TRACERS
    )
    registry.register(thing)
    return thing
