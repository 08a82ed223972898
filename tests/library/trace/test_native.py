"""Finding Embree, what is said of it, its errors, and machine code that outlives a process."""

import os
import subprocess
import sys
from importlib.machinery import ModuleSpec

import numpy as np
import pytest

import hybrid_rt as hrt
from hybrid_rt.trace import native as embree

needs_packets = pytest.mark.skipif(
    hrt.embree_problem() is not None, reason=str(hrt.embree_problem())
)


@pytest.fixture
def scene():
    vertices = np.array([(-1, -1, -2), (1, -1, -2), (0, 1, -2)], np.float32)
    return hrt.Scene.from_arrays(vertices, np.array([[0, 1, 2]], np.int32))


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A folder in which embreex seems to be installed, without any library yet."""
    package = tmp_path / "embreex"
    package.mkdir()
    spec = ModuleSpec("embreex", None, is_package=True)
    spec.submodule_search_locations = [str(package)]
    monkeypatch.setattr(embree.importlib.util, "find_spec", lambda name: spec)
    embree._library.cache_clear()
    embree._library_path.cache_clear()
    yield tmp_path
    embree._library.cache_clear()
    embree._library_path.cache_clear()


@needs_packets
def test_info_names_version_library_and_instruction_set():
    info = hrt.embree_info()
    assert set(info) == {"version", "library", "tasking", "native packets", "isa", "packet"}
    assert info["version"].startswith("4.")
    assert "embree4" in info["library"]
    assert os.sep not in info["library"]
    assert info["packet"] == "available"
    assert info["isa"] != "unknown"
    assert info["tasking"] != "unknown"


VERBOSE = """
  CPU       : Some CPU
   Targets  : SSE SSE2 SSE4.2 AVX AVX2 {more}
  Config
    Threads : 1
    Targets : SSE SSE2 SSE4.2 AVX AVXI AVX2 {more} (supported)
              SSE2 SSE4.2 AVX AVX2 AVX512  (compile time enabled)
    Features: raymasks
"""


@pytest.mark.parametrize(("more", "isa"), [("", "AVX2"), ("AVX512", "AVX512")])
def test_instruction_set_is_the_best_that_is_supported_and_compiled(more, isa):
    assert embree.parse_isa(VERBOSE.format(more=more)) == isa


def test_instruction_set_of_words_not_understood_is_unknown():
    assert embree.parse_isa("nothing of the kind") == "unknown"


@pytest.mark.parametrize(
    "place",
    [
        "embreex.libs/libembree4-0a1b2c3d.so.4",  # Linux
        "embreex/.dylibs/libembree4.4.dylib",  # macOS
        "embreex.libs/embree4-0a1b2c3d.dll",  # Windows
    ],
)
def test_library_is_found_where_wheels_keep_it(installed, place):
    file = installed / place
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(b"not a library")
    assert embree._library_path() == file
    assert "cannot be used" in hrt.embree_problem()


def test_without_the_library_packets_say_so_and_run_serves(installed, scene):
    reason = hrt.embree_problem()
    assert 'path="run" serves instead' in reason
    with pytest.raises(hrt.EmbreeError, match='path="run" serves instead'):
        hrt.EmbreeTracer(scene)
    info = hrt.embree_info()
    assert info["packet"] == reason
    assert info["version"] == "unknown"
    rays = hrt.Rays.from_arrays(np.zeros((1, 3)), np.array([(0.0, 0, -1)]))
    assert hrt.EmbreeTracer(scene, path="run").intersect(rays).t[0] == pytest.approx(2)


def test_without_embreex_the_reason_is_that(monkeypatch, installed):
    monkeypatch.setattr(embree.importlib.util, "find_spec", lambda name: None)
    assert hrt.embree_problem() == "embreex is not installed"


@needs_packets
def test_errors_of_embree_are_raised_with_its_words(scene):
    native = hrt.EmbreeTracer(scene)._bvh.native
    embree._library().rtcNewGeometry(native._device, 12345)
    with pytest.raises(hrt.EmbreeError, match="rtcNewGeometry: "):
        native._check("rtcNewGeometry")
    native._check("once only")


SCRIPT = """
import numpy as np, hybrid_rt as hrt
from hybrid_rt.kernels.trace import embree as kernels
vertices = np.array([(-1, -1, -2), (1, -1, -2), (0, 1, -2)], np.float32)
scene = hrt.Scene.from_arrays(vertices, np.array([[0, 1, 2]], np.int32))
rays = hrt.Rays.from_arrays(np.zeros((20, 3)), np.tile([(0.0, 0, -1)], (20, 1)))
tracer = hrt.EmbreeTracer(scene)
for width in (1, 4, 8, 16):
    assert (tracer.with_path(width=width).intersect(rays).prim_id == 0).all()
kernel = kernels.intersect.kernel
print(len(kernel.signatures), sum(kernel.stats.cache_hits.values()))
"""


@pytest.mark.slow
@needs_packets
def test_machine_code_is_compiled_once_and_serves_the_next_process(tmp_path):
    """Function addresses are arguments; as globals they would be of the first process."""
    environment = os.environ | {
        "NUMBA_CACHE_DIR": str(tmp_path),
        "PYTHONPATH": os.pathsep.join(p for p in sys.path if p),
    }

    def run():
        done = subprocess.run(
            [sys.executable, "-c", SCRIPT],
            env=environment, capture_output=True, text=True, check=True,
        )  # fmt: skip
        signatures, from_cache = map(int, done.stdout.split())
        assert signatures == 1
        return from_cache

    assert run() == 0
    assert run() == 1
