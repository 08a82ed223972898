"""Reach the Embree that embreex bundles: find the library, build a scene, call it from kernels.

embreex binds only the single-ray call. The library in its wheel has all of Embree, so it is loaded
once more by its path with ctypes and its packet calls are handed to compiled loops as addresses.
"""

from __future__ import annotations

import ctypes
import functools
import importlib.util
import re
import subprocess
import sys
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hybrid_rt.errors import EmbreeError
from hybrid_rt.kernels.arrays import F32, I32, Bool
from hybrid_rt.kernels.trace import embree as kernels
from hybrid_rt.rays.hits import Hits
from hybrid_rt.rays.rays import Rays
from hybrid_rt.scene.mesh import Scene

WIDTHS = (1, 4, 8, 16)
QUALITIES = ("low", "medium", "high")  # in the order of RTCBuildQuality

_RTC_GEOMETRY_TYPE_TRIANGLE = 0
_RTC_BUFFER_TYPE_INDEX, _RTC_BUFFER_TYPE_VERTEX = 0, 1
_RTC_FORMAT_UINT3, _RTC_FORMAT_FLOAT3 = 0x5003, 0x9003
_RTC_SCENE_FLAG_ROBUST = 4
_RTC_RAY_QUERY_FLAG_COHERENT = 1 << 16
_RTC_FEATURE_FLAG_ALL = 0xFFFFFFFF
_RTC_ERRORS = {
    1: "unknown error",
    2: "invalid argument",
    3: "invalid operation",
    4: "out of memory",
    5: "unsupported CPU",
    6: "cancelled",
}
_PROPERTY_VERSION, _PROPERTY_TASKING = 0, 128
_PROPERTY_NATIVE = {4: 32, 8: 33, 16: 34}
_NO_INDICES = np.empty(0, np.int32)
_TASKING = {0: "internal", 1: "TBB", 2: "PPL"}

# Signature of every function used: result, then arguments.
_P, _I, _U, _Z = ctypes.c_void_p, ctypes.c_int, ctypes.c_uint, ctypes.c_size_t
_SIGNATURES: dict[str, tuple[object, list[object]]] = {
    "rtcNewDevice": (_P, [ctypes.c_char_p]),
    "rtcReleaseDevice": (None, [_P]),
    "rtcGetDeviceError": (_I, [_P]),
    "rtcGetDeviceLastErrorMessage": (ctypes.c_char_p, [_P]),
    "rtcGetDeviceProperty": (ctypes.c_ssize_t, [_P, _I]),
    "rtcNewScene": (_P, [_P]),
    "rtcReleaseScene": (None, [_P]),
    "rtcSetSceneFlags": (None, [_P, _I]),
    "rtcSetSceneBuildQuality": (None, [_P, _I]),
    "rtcCommitScene": (None, [_P]),
    "rtcNewGeometry": (_P, [_P, _I]),
    "rtcReleaseGeometry": (None, [_P]),
    "rtcSetSharedGeometryBuffer": (None, [_P, _I, _U, _I, _P, _Z, _Z, _Z]),
    "rtcCommitGeometry": (None, [_P]),
    "rtcAttachGeometry": (_U, [_P, _P]),
}


def embree_problem() -> str | None:
    """Return why ``path="packet"`` cannot be used, None where it can."""
    try:
        _library()
    except EmbreeError as error:
        return str(error)
    return None


def embree_info() -> dict[str, str]:
    """Return what is known of the Embree in use.

    Returns
    -------
    dict of str to str
        "version"; "library" (file name); "tasking"; "native packets" (the widths for which Embree
        has code of its own on this CPU, others are split); "isa" (the instruction set that Embree
        chose for its kernels); "packet" ("available", or the reason why it is not). What cannot be
        found out is "unknown".
    """
    reason = embree_problem()
    if reason is not None:
        keys = ("version", "library", "tasking", "native packets", "isa")
        return dict.fromkeys(keys, "unknown") | {"packet": reason}
    lib = _library()
    device = _new_device(lib, threads=1)
    try:
        number = lib.rtcGetDeviceProperty(device, _PROPERTY_VERSION)
        tasking = lib.rtcGetDeviceProperty(device, _PROPERTY_TASKING)
        native = [w for w, p in _PROPERTY_NATIVE.items() if lib.rtcGetDeviceProperty(device, p)]
    finally:
        lib.rtcReleaseDevice(device)
    return {
        "version": f"{number // 10000}.{number // 100 % 100}.{number % 100}",
        "library": _library_path().name,
        "tasking": _TASKING.get(tasking, "unknown"),
        "native packets": ", ".join(str(w) for w in native) or "none",
        "isa": _isa(),
        "packet": "available",
    }


@dataclass(frozen=True)
class Way:
    """How Embree is called: rays in a packet, the coherent flag, packets sorted by direction."""

    width: int
    coherent: bool
    by_direction: bool


class NativeScene:
    """A scene in Embree whose packet calls are reached from compiled loops.

    Released when the last reference goes.

    Parameters
    ----------
    scene : Scene
    threads : int
        Threads that build; tracing takes its own number.
    robust : bool
    build_quality : {"low", "medium", "high"}

    Raises
    ------
    EmbreeError
        The library cannot be reached, or Embree reports an error.
    """

    def __init__(self, scene: Scene, *, threads: int, robust: bool, build_quality: str) -> None:
        lib = _library()
        self._device = _new_device(lib, threads)
        self._finalizer = weakref.finalize(self, lib.rtcReleaseDevice, self._device)
        # Embree shares these buffers. It reads 16 bytes at every vertex of 12, hence one row more.
        self._vertices = np.zeros((len(scene.vertices) + 1, 3), np.float32)
        self._vertices[:-1] = scene.vertices
        self._faces = scene.faces.astype(np.uint32)

        self._scene = handle = lib.rtcNewScene(self._device)
        self._check("rtcNewScene")
        self._finalizer.detach()
        self._finalizer = weakref.finalize(
            self, _release, lib, self._device, handle, (self._vertices, self._faces)
        )
        lib.rtcSetSceneFlags(handle, _RTC_SCENE_FLAG_ROBUST if robust else 0)
        lib.rtcSetSceneBuildQuality(handle, QUALITIES.index(build_quality))
        geometry = lib.rtcNewGeometry(self._device, _RTC_GEOMETRY_TYPE_TRIANGLE)
        self._check("rtcNewGeometry")
        for kind, form, array, count in (
            (_RTC_BUFFER_TYPE_VERTEX, _RTC_FORMAT_FLOAT3, self._vertices, len(scene.vertices)),
            (_RTC_BUFFER_TYPE_INDEX, _RTC_FORMAT_UINT3, self._faces, len(scene.faces)),
        ):
            lib.rtcSetSharedGeometryBuffer(geometry, kind, 0, form, array.ctypes.data, 0, 12, count)
        lib.rtcCommitGeometry(geometry)
        lib.rtcAttachGeometry(handle, geometry)
        lib.rtcReleaseGeometry(geometry)  # the scene keeps it
        lib.rtcCommitScene(handle)
        self._check("rtcCommitScene")

    def intersect(self, rays: Rays, hits: Hits, indices: I32 | None, way: Way) -> None:
        """Write the nearest hits of the rays at `indices`, or of all, into their rows of `hits`."""
        with self._asking("rtcIntersect", indices, way) as query:
            kernels.intersect(query, rays.arrays, hits.arrays)

    def occluded(self, rays: Rays, hit: Bool, indices: I32 | None, way: Way) -> None:
        """Write whether rays hit anything; as `intersect`."""
        with self._asking("rtcOccluded", indices, way) as query:
            kernels.occluded(query, rays.arrays, hit)

    @contextmanager
    def _asking(self, call: str, indices: I32 | None, way: Way) -> Iterator[kernels.Query]:
        """Yield what a kernel asks Embree for, and raise the error that came of it."""
        arguments = _query_arguments(way.coherent)
        yield kernels.Query(
            _address(f"{call}{way.width}"), self._scene, arguments.ctypes.data, way.width,
            indices is not None, _NO_INDICES if indices is None else indices, way.by_direction,
        )  # fmt: skip
        self._check(f"{call}{way.width}")

    def _check(self, call: str) -> None:
        _check_device(_library(), self._device, call)


def usable(rays: Rays) -> tuple[Bool, F32]:
    """Return which rays may be given to Embree, and the factors that their directions need."""
    valid, scale = np.empty(len(rays), np.bool_), np.empty(len(rays), np.float32)
    origin, direction, _, t_near, t_far = rays.arrays
    kernels.usable(origin, direction, t_near, t_far, valid, scale)
    return valid, scale


def _release(lib: ctypes.CDLL, device: int, scene: int, buffers: tuple[F32, ...]) -> None:
    # `buffers` is here so that the shared arrays outlive the scene.
    lib.rtcReleaseScene(scene)
    lib.rtcReleaseDevice(device)


def _query_arguments(coherent: bool) -> np.ndarray:
    """RTCIntersectArguments or RTCOccludedArguments, which begin alike, with all pointers null.

    uint32 flags, uint32 feature_mask, then pointers: context, filter, intersect or occluded.
    """
    words = np.zeros(16, np.uint32)
    words[0] = _RTC_RAY_QUERY_FLAG_COHERENT if coherent else 0
    words[1] = _RTC_FEATURE_FLAG_ALL
    return words


def _address(name: str) -> int:
    return ctypes.cast(getattr(_library(), name), ctypes.c_void_p).value or 0


def _new_device(lib: ctypes.CDLL, threads: int) -> int:
    device = lib.rtcNewDevice(f"threads={threads}".encode())
    if not device:
        _check_device(lib, None, "rtcNewDevice")
        raise EmbreeError("rtcNewDevice: no device, and no error either")
    return int(device)


def _check_device(lib: ctypes.CDLL, device: int | None, call: str) -> None:
    code = lib.rtcGetDeviceError(device)
    if code:
        message = (lib.rtcGetDeviceLastErrorMessage(device) or b"").decode(errors="replace")
        name = _RTC_ERRORS.get(code, f"error {code}")
        raise EmbreeError(f"{call}: {name}" + (f" ({message})" if message else ""))


@functools.cache
def _library_path() -> Path:
    """Find the shared library in the places where wheels keep bundled ones on each system."""
    spec = importlib.util.find_spec("embreex")
    if spec is None or not spec.submodule_search_locations:
        raise EmbreeError("embreex is not installed")
    package = Path(next(iter(spec.submodule_search_locations)))
    for folder in (
        package.parent / "embreex.libs",
        package / ".dylibs",
        package / ".libs",
        package,
    ):
        for pattern in ("libembree4*", "embree4*.dll"):
            found = sorted(folder.glob(pattern))
            if found:
                return found[0]
    raise EmbreeError(
        "the installed embreex bundles no Embree library beside it, so its packet calls cannot be "
        'reached; path="run" serves instead'
    )


@functools.cache
def _library() -> ctypes.CDLL:
    path = _library_path()
    try:
        import embreex  # noqa: F401  (on Windows it adds the folder of the bundled libraries)

        lib = ctypes.CDLL(str(path))
        for name, (result, arguments) in _SIGNATURES.items():
            function = getattr(lib, name)
            function.restype = result
            function.argtypes = arguments
        for width in WIDTHS:
            getattr(lib, f"rtcIntersect{width}")
            getattr(lib, f"rtcOccluded{width}")
    except (ImportError, OSError, AttributeError) as error:
        raise EmbreeError(
            f'{path.name} cannot be used ({error}); path="run" serves instead'
        ) from error
    return lib


@functools.cache
def _isa() -> str:
    """Return the instruction set of Embree's kernels on this CPU, or "unknown".

    No property holds it; Embree only prints it, to the standard output of its process. So a
    process of its own is asked, and its words are read.
    """
    script = "import ctypes, sys; ctypes.CDLL(sys.argv[1]).rtcNewDevice(b'verbose=1,threads=1')"
    try:
        answer = subprocess.run(
            [sys.executable, "-I", "-c", script, str(_library_path())],
            capture_output=True,
            text=True,
            timeout=60,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return parse_isa(answer.stdout)


def parse_isa(text: str) -> str:
    """Return the best instruction set that is both supported and compiled in, from verbose text."""
    targets = re.search(
        r"Config.*?Targets\s*:(?P<cpu>.*?)\(supported\)(?P<built>.*?)\(compile time enabled\)",
        text,
        re.DOTALL,
    )
    if targets is None:
        return "unknown"
    supported = set(targets["cpu"].split())
    usable = [name for name in targets["built"].split() if name in supported]
    return usable[-1] if usable else "unknown"
