"""Take away the guards of the certified proof, one at a time, and see that a test fails for each.

Not collected by pytest: run ``python tests/mutation/guards.py [--jobs 2] [NAME ...]`` from the
root. Each mutant is a copy of the library and its tests in a temporary directory with one place
changed. Exit code 1 if a mutant survives.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LISTS, WALK = (
    "hybrid_rt/kernels/raster/lists.py",
    "hybrid_rt/kernels/techniques/certified/scalar.py",
)
TEST_LISTS = "tests/library/raster/test_lists.py"
TEST_WALK = "tests/library/techniques/test_certified.py"
ROUNDING = "tests/library/techniques/test_certified_precision.py"
HYBRID = "tests/library/hybrid/test_hybrid.py"
CAMERAS = "tests/library/techniques/test_technique_cameras.py"
LANES = "tests/library/techniques/test_certified_lanes.py"
PLANES = "tests/library/raster/test_lists_precision.py"
BINS = "hybrid_rt/kernels/raster/lists_bins.py"
FACE_PLANES = "hybrid_rt/kernels/raster/lists_planes.py"


@dataclass(frozen=True)
class Mutant:
    """One guard taken away: `old` becomes `new` in `file`; `tests` should notice."""

    name: str
    file: str
    old: str
    new: str
    tests: str


MUTANTS = (
    Mutant("lists at pixel centres", FACE_PLANES,
           "half = 0.5 + margin", "half = 0.0", TEST_LISTS),
    Mutant("no margin", "hybrid_rt/raster/lists.py",
           "MARGIN_ULPS = 16", "MARGIN_ULPS = 0", ROUNDING),
    Mutant(
        "triangles across the near plane left out", BINS,
        "return True, 0, 0, width - 1, height - 1", "return False, 0, 0, 0, 0", TEST_LISTS,
    ),
    Mutant(
        "bounds rounded to nearest", BINS,
        "simd.to_f32(depth * (1.0 + 2.0**-22))", "simd.to_f32(depth)", ROUNDING,
    ),
    Mutant(
        "nearest vertex forgotten to be clipped", BINS,
        "high / simd.maximum(q2 - e2, close)", "high / q2", TEST_LISTS,
    ),
    Mutant("what falls out of a list forgotten", LISTS,
           "if n <= length:", "if n < length:", TEST_LISTS),
    Mutant("hidden by the farthest pixel's neighbours", LISTS,
           "return simd.reduce_min(simd.select(there, low, FULL))",
           "return -simd.reduce_min(-simd.select(there, low, np.int32(0)))", TEST_LISTS),
    Mutant("rest not looked at", WALK, "if full and not lowest > rest[cy, cx]:",
           "if full and lowest < F0:", TEST_WALK),
    Mutant("only the first of a list tested", WALK,
           "if prim < 0 or nearest[cy, cx, k] < lowest:", "if prim < 0 or k > 0:", TEST_WALK),
    Mutant("coarse cells taken for free", WALK, "if near > F0 and not lowest > near:",
           "if near > F0 and level < 2 and not lowest > near:", TEST_WALK),
    Mutant("depth of the walk not lowered", WALK, "DEPTH_ULPS = 8.0", "DEPTH_ULPS = 0.0", ROUNDING),
    Mutant("ends beyond the near plane", "hybrid_rt/kernels/techniques/screen.py",
           "s_end = (d - w) / (d * gw - w * gd)",
           "s_end = 3.0 * (d - w) / (d * gw - w * gd)", TEST_WALK),
    Mutant("ends beyond the far plane", "hybrid_rt/kernels/techniques/screen.py",
           "BEFORE_FAR = 1.0 - 2.0**-16", "BEFORE_FAR = 1.5", CAMERAS),
    Mutant("a mirror image taken for one that is none", FACE_PLANES,
           "side * hand", "side", CAMERAS),
    Mutant("edges without slack", WALK,
           "slack = 16.0 * E * r * size + 64.0 * (E * r) * (E * r)", "slack = 0.0", TEST_WALK),
    Mutant("ties decided", WALK, "found == T_UNDECIDED or (best >= 0 and high >= best_low)",
           "found == T_UNDECIDED", TEST_WALK),
    Mutant("first hit found taken for the nearest", WALK, "            if any_hit:",
           "            if best >= 0:", TEST_WALK),
    Mutant("set-up trusted", WALK, "return spread * error <= U / 8.0 and",
           "return spread >= 0.0 and", TEST_WALK),
    Mutant("scene's bounds reached too early", WALK,
           "return t_exit + 2.0**-40 * abs(t_exit)", "return 0.5 * t_exit", TEST_WALK),
    Mutant("more said to be free than is", WALK,
           "return HIDDEN, -1, -1, -1, math.inf, s / scale, steps, tests",
           "return HIDDEN, -1, -1, -1, math.inf, end / scale, steps, tests", TEST_WALK),
    Mutant("plane without error", WALK, "front = min(above, then) > error",
           "front = min(above, then) > F0", PLANES),
    Mutant("behind without the error of the ray", WALK,
           "behind = max(above, then) + z_error < -error", "behind = max(above, then) < -error",
           PLANES),
    Mutant("plane looked at in one end only", WALK, "front = min(above, then) > error",
           "front = above > error", PLANES),
    Mutant("planes without the margin", FACE_PLANES,
           "(steep_x + steep_y) * margin + reach", "reach", PLANES),
    Mutant("skipped rays taken for free", "hybrid_rt/kernels/techniques/certified/lanes.py",
           "unmarched(i, SKIPPED, F32(0.0), out)", "unmarched(i, MISS, F32(0.0), out)",
           LANES),
    Mutant("handed over behind what is free", "hybrid_rt/kernels/hybrid.py",
           "HAND_OVER_BACK = 1.0 - 2.0**-8", "HAND_OVER_BACK = 1.5", HYBRID),
)  # fmt: skip


def _left_out(folder, names):
    # Compiled code is kept by a digest of all kernels: it serves mutants of what is no kernel.
    return {"__pycache__"} & set(names) if Path(folder) != ROOT / "hybrid_rt" else ()


def killed(mutant):
    """Return the first test that fails for a mutant, None if it survives."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        for name in ("hybrid_rt", "tests", "bench", "scenes"):
            shutil.copytree(ROOT / name, copy / name, ignore=_left_out)
        shutil.copy(ROOT / "pyproject.toml", copy)
        path = copy / mutant.file
        text = path.read_text()
        if text.count(mutant.old) != 1:
            raise SystemExit(f"{mutant.name}: {text.count(mutant.old)} places to change, not 1")
        path.write_text(text.replace(mutant.old, mutant.new))
        run = subprocess.run(
            [sys.executable, "-m", "pytest", "-q", "-x", "--no-header", mutant.tests],
            cwd=copy, capture_output=True, text=True, check=False,
        )  # fmt: skip
        if run.returncode not in (0, 1):
            raise SystemExit(f"{mutant.name}: the tests could not be run\n{run.stdout}{run.stderr}")
        failed = [line for line in run.stdout.splitlines() if line.startswith("FAILED")]
        return failed[0].split()[1] if failed else None


def main():
    """Run the mutants named on the command line, or all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="mutants; default: all")
    parser.add_argument("--jobs", type=int, default=1, help="mutants tested at a time")
    arguments = parser.parse_args()
    chosen = [m for m in MUTANTS if not arguments.names or m.name in arguments.names]
    survivors = 0
    with ThreadPoolExecutor(arguments.jobs) as pool:
        for mutant, test in zip(chosen, pool.map(killed, chosen), strict=True):
            survivors += test is None
            print(f"{mutant.name}: {test or 'SURVIVES'}", flush=True)
    raise SystemExit(1 if survivors else 0)


if __name__ == "__main__":
    main()
