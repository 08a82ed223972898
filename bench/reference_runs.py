"""Make the runs behind docs/results/: ``python bench/reference_runs.py [NAME ...]``.

They take about half an hour on two cores, which nothing else should use meanwhile, and need the
real scenes. Each is measured into reports/, and what is small of its folder takes the place of
docs/results/NAME. `make results` then renders tables, figures and findings from there.
"""

import argparse
import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

from hybrid_rt_scenes import get_scene

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "docs" / "results"

RUNS = {
    "stability": "run stability",
    "error": "run error --scenes sponza,bistro,atrium --cameras nave,street --resolutions 1280x720",
    "hybrid": "run hybrid --scenes sponza,bistro,street --resolutions 1920x1080",
    "paper": "run paper --cameras front,low,nave,gallery,corner,street "
    "--resolutions 1280x720,1920x1080,3840x2160 --rounds 5",
    "roofline": "run roofline --cameras nave,gallery,corner,street --rounds 5",
    "ablation": "run ablation --cameras nave,corner --rounds 2",
    "scaling": "run scaling --series triangles --triangles 2^10,2^12,2^14,2^16,2^18,2^20 "
    "--rounds 3",
}
"""Words of the command line behind each folder of docs/results, in the order of measuring."""

SCENES = ("nori_sphere", "sponza", "bistro")
KEPT = ("run.json", "samples.parquet", "results.parquet", "verdicts.parquet")
"""What is committed of a run's folder; pixels are left out, and with them the pictures."""


def keep(folder: Path, target: Path) -> None:
    """Put what is small of a run's folder in the place of `target`."""
    if target.exists():
        shutil.rmtree(target)
    target.mkdir(parents=True)
    for name in KEPT:
        if (folder / name).is_file():
            shutil.copy(folder / name, target)
    path = target / "run.json"
    meta = json.loads(path.read_text(encoding="utf-8"))
    for cell in meta["cells"]:
        cell.pop("picture", None)
    path.write_text(json.dumps(meta, indent=1) + "\n", encoding="utf-8")


def main() -> int:
    """Measure the runs that are named, or all; return an exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(RUNS))
    chosen = parser.parse_args().names or list(RUNS)
    wrong = [name for name in chosen if name not in RUNS]
    absent = [said for name in SCENES if (said := get_scene(name).missing())]
    if wrong or absent:
        print(*[f"no run is called {name!r}" for name in wrong], *absent, sep="\n", file=sys.stderr)
        return 2
    begin = time.monotonic()
    for name in chosen:
        start = time.monotonic()
        words = [sys.executable, "-m", "hybrid_rt_bench", *RUNS[name].split(), "--out", "reports"]
        print(f"{name}: hybrid-rt {RUNS[name]}", flush=True)
        done = subprocess.run([*words, "--json"], cwd=ROOT, stdout=subprocess.PIPE, check=False)
        if done.returncode:
            print(f"{name}: failed, docs/results is as it was", file=sys.stderr)
            return done.returncode
        keep(ROOT / json.loads(done.stdout)["folder"], RESULTS / name)
        print(f"{name}: {(time.monotonic() - start) / 60:.1f} minutes", flush=True)
    print(f"all: {(time.monotonic() - begin) / 60:.1f} minutes; now `make results`")
    return 0


if __name__ == "__main__":
    sys.exit(main())
