"""Measure what the first picture of a fresh installation waits for: ``python bench/cold_start.py``.

Each run is a process with an empty folder for compiled code. It prints the seconds of every stage
of the first picture, then of the certified march, and the medians of all runs.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time

STAGES = ("rasterize", "prepare", "mirror rays", "march", "embree", "hybrid")
CERTIFIED = ("prepare certified", "march certified", "hybrid certified")


def measure():
    """Render one picture, and print the seconds after each stage since the process began to."""
    start = time.perf_counter()
    import hybrid_rt as hrt
    import hybrid_rt_scenes

    def done(stage, made):
        print(f"{stage}\t{time.perf_counter() - start:.3f}", flush=True)
        return made

    spec = hybrid_rt_scenes.get_scene("sphere")
    scene = spec.load()
    view = next(iter(spec.cameras.values()))
    camera = hrt.Camera.look_at(view.eye, view.target, width=320, height=180, near=view.near)
    gbuffer = done("rasterize", hrt.rasterize(scene, camera))
    screen = done("prepare", hrt.prepare(gbuffer, "paper"))
    rays = done("mirror rays", hrt.mirror_rays(gbuffer))
    done("march", hrt.march(rays, screen))
    tracer = hrt.EmbreeTracer(scene)
    done("embree", tracer.intersect(rays))
    done("hybrid", hrt.trace_hybrid(rays, screen, tracer))
    certified = done("prepare certified", hrt.prepare(gbuffer, "certified"))
    done("march certified", hrt.march(rays, certified))
    done("hybrid certified", hrt.trace_hybrid(rays, certified, tracer))


def main():
    """Run the measurement in processes, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=3, help="processes, each with an empty cache")
    parser.add_argument("--one", action="store_true", help="measure in this process, as it is")
    arguments = parser.parse_args()
    if arguments.one:
        measure()
        return
    runs = []
    for _ in range(arguments.runs):
        with tempfile.TemporaryDirectory() as folder:
            environment = os.environ | {"NUMBA_CACHE_DIR": folder}
            done = subprocess.run(
                [sys.executable, __file__, "--one"],
                env=environment, stdout=subprocess.PIPE, text=True, check=True,
            )  # fmt: skip
        runs.append(dict(line.split("\t") for line in done.stdout.splitlines()))
    print(f"seconds since the start, median of {len(runs)}   each")
    for stage in (*STAGES, *CERTIFIED):
        seconds = [float(run[stage]) for run in runs]
        each = "  ".join(f"{s:6.2f}" for s in seconds)
        print(f"{stage:20s} {statistics.median(seconds):6.2f}   {each}")


if __name__ == "__main__":
    main()
