"""Runs of every kind made up for tests of figures, with rows as their schemas say.

A layout says the scenes and techniques of a run. The last technique of several lacks the first
view of the last scene, so that there is always something that is missing.
"""

import dataclasses
import math

import numpy as np

from hybrid_rt_bench.judged import columns as judged
from hybrid_rt_bench.kinds.frame import columns as frame
from hybrid_rt_bench.kinds.paper import columns as paper
from hybrid_rt_bench.kinds.paper import summary
from hybrid_rt_bench.kinds.peers import columns as peers
from hybrid_rt_bench.kinds.roofline import columns as roofline
from hybrid_rt_bench.kinds.roofline.reckon import STRUCTURES
from hybrid_rt_bench.kinds.scaling import columns as scaling
from hybrid_rt_bench.kinds.scaling import stages
from hybrid_rt_bench.kinds.stability import columns as stability
from hybrid_rt_bench.results import folder as results
from hybrid_rt_bench.results.schema import HYBRID_STAGES
from hybrid_rt_bench.runs import read_run
from support.bench_rows import ENVIRONMENT, whole

LONG = "a-street-of-shops-behind-the-old-town-hall"


@dataclasses.dataclass(frozen=True)
class Layout:
    """What is in a run."""

    scenes: tuple[str, ...]
    cameras: tuple[str, ...]
    techniques: tuple[str, ...]
    sizes: tuple[tuple[int, int], ...] = ((1280, 720),)

    def views(self):
        """Return every scene, camera and size, with the number of its scene."""
        return [
            (number, scene, camera, width, height)
            for number, scene in enumerate(self.scenes)
            for camera in self.cameras
            for width, height in self.sizes
        ]

    def measured(self, scene, camera):
        """Return the techniques of a view."""
        lacking = len(self.techniques) > 1 and (scene, camera) == (self.scenes[-1], self.cameras[0])
        return self.techniques[:-1] if lacking else self.techniques


LAYOUTS = {
    "one scene, one technique": Layout(("hall",), ("front",), ("paper",)),
    "one scene, two techniques": Layout(("hall",), ("front", "from above"), ("certified", "paper")),
    "two scenes, one technique": Layout(("hall", "yard"), ("front", "low"), ("slope",)),
    "two scenes, three techniques": Layout(
        ("hall", LONG), ("front", "low"), ("certified", "paper", "mine"), ((640, 360), (3840, 2160))
    ),
    "many scenes, many techniques": Layout(
        ("hall", LONG, "yard", "kitchen_of_the_old_house", "nave", "Bistro Exterior at Night", "s"),
        ("front", "a camera with a long name"),
        ("certified", "paper", "slope", "hiz", "dda", "linear", "someones-own-technique-thick"),
        ((640, 360), (1280, 720), (3840, 2160)),
    ),
}

ENTRIES = {"builtin": True, "row": "Sponza"}
PARTIAL = {"mark": "partial", "note": "a tenth of its triangles are absent"}
"""Of the scene with the long name."""
MACHINE = {**ENVIRONMENT, "cpu": "Intel(R) Xeon(R) Platinum 8481C CPU @ 2.70GHz"}


def _writer(out, kind, schema, layout, **meta):
    about = {
        "kind": kind, "command": [], "notes": [], "warnings": [], "environment": MACHINE,
        "spec": {"title": "Made up", "rounds": 3, "repeats": 2},
        "scenes": [
            {"name": s, "triangles": 10**k, **ENTRIES, **(PARTIAL if s == LONG else {})}
            for k, s in enumerate(layout.scenes)
        ],
        **meta,
    }  # fmt: skip
    writer = results.create_run(out, kind, schema, about)
    writer.flush = lambda: None  # once, at the end
    return writer


def _done(writer):
    del writer.flush
    writer.finish()
    writer.__exit__(None, None, None)
    return read_run(writer.folder)


def _share(*names):
    """Return a number in 0 to 1 that depends on names alone."""
    return (sum((k + 7) * ord(c) for k, c in enumerate("/".join(names))) % 997) / 997


def paper_run(out, layout, zeros=False):
    """Return a run of kind "paper"; with `zeros`, no answer is wrong and none is given."""
    writer = _writer(out, "paper", paper.SCHEMA, layout)
    for number, scene, camera, width, height in layout.views():
        rays = width * height
        rows, samples, verdicts = [], [], []
        shared = {"raster": 8, "pyramid": 2, "rays": 5, "embree_primary": 10, "embree": 100}
        stage_rows = [("", stage, ms) for stage, ms in shared.items()]
        for technique in layout.measured(scene, camera):
            alpha = 0.0 if zeros else 0.15 + 0.6 * _share(scene, camera, technique)
            mine = {"march": 20 + 60 * _share(technique), "compaction": 3, "merge": 2}
            mine["fallback"] = 90 * (1 - alpha)
            stage_rows += [(technique, stage, ms) for stage, ms in mine.items()]
            timed = {
                stage: np.array([rays * ms * (1 + r / 50) / 3e8 for r in range(3)])
                for stage, ms in {**shared, **mine}.items()
            }
            row = {
                "technique": technique, "rays": rays, "resolved": int(alpha * rays),
                "alpha": alpha, "steps_per_ray": 20.0, **summary.timing_columns(timed, alpha),
                "embree_path": "packet 8", "embree_primary_path": "packet 16",
            }  # fmt: skip
            for name in (*paper.RATES, "pixel_error"):
                rate = 0.0 if zeros or name == "false_miss" else 0.02 * _share(technique, name)
                row |= {f"{name}_count": int(rate * rays), f"{name}_rate": rate}
                row |= {f"{name}_low": 0.7 * rate, f"{name}_high": 1.5 * rate + 1e-6}
            rows.append(whole(paper.SCHEMA, "results", row))
            verdicts.append({"technique": technique, "status": "HIT", "verdict": "CORRECT",
                             "count": rays})  # fmt: skip
        for technique, stage, ms in stage_rows:
            for r in range(3):
                samples.append({"technique": technique, "stage": stage, "round": r,
                                "seconds": rays * ms * (1 + r / 50) / 3e8,
                                "phase": "measured"})  # fmt: skip
        picture = None
        if (width, height) == layout.sizes[0] and number < 2:
            grey = np.tile(np.linspace(0, 255, 160).astype(np.uint8), (90, 1))
            picture = {"shaded": np.repeat(grey[..., None], 3, axis=2)}
            for technique in layout.measured(scene, camera):
                picture[f"grey_{technique}"] = grey
                picture[f"classes_{technique}"] = _squares(4)
        cell = {"scene": scene, "camera": camera, "width": width, "height": height}
        writer.add_cell(cell, samples, rows, verdicts, picture)
    return _done(writer)


def _squares(classes):
    """Return a picture of squares, of every class."""
    y, x = np.mgrid[:90, :160] // 10
    return ((x + 3 * y) % classes).astype(np.uint8)


def judged_run(out, layout, kind="error", zeros=False, timed=True):
    """Return a run of a kind that judges every answer; with `zeros`, no answer is wrong."""
    writer = _writer(out, kind, judged.SCHEMA, layout)
    workloads = ("mirror", "diffuse") if len(layout.scenes) < 5 else (
        "mirror", "glossy_0.3", "diffuse", "ambient_occlusion", "shadow_point", "shadow_sun",
        "refraction_1.5", "glossy_0.6",
    )  # fmt: skip
    for number, scene, camera, width, height in layout.views():
        for workload in workloads:
            rays = width * height
            measured = [t for t in layout.measured(scene, camera)
                        if (t, workload) != (layout.techniques[-1], "diffuse")]  # fmt: skip
            rows, samples = [], []
            for technique in (*measured, judged.EMBREE):
                embree = technique == judged.EMBREE
                points = ("default", "robust") if embree else ("default", "thickness 2 %")
                for k, point in enumerate(points):
                    alpha = 1.0 if embree else 0.1 + 0.6 * _share(scene, technique, point)
                    wrong = 0 if zeros or technique == "certified" else int(
                        rays * 10 ** (-1 - 4 * _share(technique, point))
                    )  # fmt: skip
                    hybrid = 0.5 + 0.9 * _share(technique, point, workload)
                    row = {
                        "technique": technique, "point": point, "default": k == 0, "rays": rays,
                        "resolved": int(alpha * rays), "alpha": alpha, "false_hit": wrong,
                        "all_false_hit": wrong, "steps": 20.0 * rays, "timed": timed,
                        "prepare_ms": 3.0, "wrong_rate": wrong / rays, "march_ms": 500 * hybrid,
                        "hybrid_ms": 1e3 * hybrid, "embree_ms": 1e3,
                    }  # fmt: skip
                    rows.append(whole(judged.SCHEMA, "results", row))
                    for r in range(3 if timed else 0):
                        samples.append(
                            {"technique": technique, "point": point, "round": r, "embree": 1.0,
                             "march": hybrid / 2, "compaction": hybrid / 4, "merge": hybrid / 8,
                             "fallback": hybrid / 8, "hybrid": hybrid * (1 + 0.03 * r)}
                        )  # fmt: skip
            picture = None
            if workload == "mirror" and (width, height) == layout.sizes[0] and number < 2:
                picture = {"grey": np.tile(np.linspace(0, 255, 160).astype(np.uint8), (90, 1))}
                picture |= {f"classes_{t}": _squares(6) for t in measured}
            cell = {"scene": scene, "camera": camera, "width": width, "height": height}
            cell |= {"workload": workload, "seed": 0}
            verdicts = [{"technique": t, "point": "default", "status": "HIT", "verdict": "CORRECT",
                         "count": rays} for t in measured]  # fmt: skip
            writer.add_cell(cell, samples, rows, verdicts, picture)
    return _done(writer)


def frame_run(out, layout, judged=True):
    """Return a run of a depth buffer of someone's own, with its mesh or, not judged, without."""
    about = {
        "file": "dump.npz", "dtype": "float32", "reading": {"kind": "reversed"}, "covered": 0.83,
        "mesh": f"{layout.scenes[0]}.obj" if judged else None, "unmatched": 3, "uncertain": True,
        "uncertainty": 1e-6,
    }  # fmt: skip
    writer = _writer(out, "frame", frame.SCHEMA, layout, frame=about)
    width, height = layout.sizes[0]
    rays = width * height
    for workload in ("mirror", "ambient_occlusion"):
        rows, verdicts, picture = [], [], {"grey": np.full((90, 160), 120, np.uint8)}
        for technique in layout.techniques:
            alpha = 0.1 + 0.6 * _share(technique, workload)
            resolved = int(alpha * rays)
            row = {
                "technique": technique, "judged": judged, "rays": rays, "resolved": resolved,
                "hits": resolved, "false_hit": rays // 90, "alpha": alpha, "steps": 20 * rays,
                "wrong_rate": rays // 90 / resolved, "wrong_low": 0.001, "wrong_high": 0.02,
            }  # fmt: skip
            rows.append(whole(frame.SCHEMA, "results", row))
            verdict = "CORRECT" if judged else frame.UNJUDGED
            verdicts += [
                {"technique": technique, "status": status, "verdict": verdict, "count": rays // 2}
                for status in ("HIT", "HIDDEN")
            ]
            picture[f"status_{technique}"] = _squares(9)
            if judged:
                picture[f"classes_{technique}"] = _squares(6)
        cell = {"scene": layout.scenes[0], "camera": "own", "width": width, "height": height}
        kept = picture if workload == "mirror" else None
        writer.add_cell({**cell, "workload": workload}, [], rows, verdicts, kept)
    return _done(writer)


def peers_run(out, layout):
    """Return a run of kind "peers"; its peers take the techniques' names."""
    names = ("embree", *layout.techniques)
    entries = [{"name": n, "version": "1", "detail": "", "description": ""} for n in names]
    writer = _writer(out, "peers", peers.SCHEMA, layout, peers=entries)
    for _, scene, camera, width, height in layout.views():
        rows, samples = [], []
        for name in names:
            ran = name == "embree" or name in layout.measured(scene, layout.cameras[0])
            for workload in ("mirror", "primary"):
                ms = 10 ** (3 * _share(name, scene, workload)) if ran else math.nan
                row = {
                    "technique": name, "workload": workload, "state": "ok" if ran else "absent",
                    "reason": "" if ran else "ImportError: no such module", "rays": 921600,
                    "threads": 2 if ran else 0, "ms": ms,
                }  # fmt: skip
                rows.append(whole(peers.SCHEMA, "results", row))
        cell = {"scene": scene, "camera": camera, "width": width, "height": height}
        writer.add_cell(cell, samples, rows, [])
    return _done(writer)


def stability_run(out, layout):
    """Return a run of kind "stability": a case for each scene and camera."""
    writer = _writer(out, "stability", stability.SCHEMA, layout)
    names = (*layout.techniques, "embree default", "embree robust")
    for scene in layout.scenes:
        for camera in layout.cameras:
            rows = []
            lacking = set(layout.techniques) - set(layout.measured(scene, camera))
            for name in names:
                wrong = int(1000 * max(0.0, _share(scene, camera, name) - 0.4) ** 2)
                state = "fail" if wrong else "pass"
                row = {"technique": name, "state": state, "rays": 1000, "wrong": wrong,
                       "unresolved": 200, "false_hit": wrong, "first": "{}"}  # fmt: skip
                if _share(name, camera) > 0.95:
                    row |= {"state": "error", "error": "ValueError: none", "unresolved": 1000}
                if name not in lacking:
                    rows.append(whole(stability.SCHEMA, "results", row))
            cell = {"case": f"{scene} {camera}", "what_goes_wrong": "", "rays": 1000,
                    "triangles": 10, "hits": 900, "ambiguous": 0}  # fmt: skip
            writer.add_cell(cell, [], rows, [])
    return _done(writer)


def scaling_run(out, layout):
    """Return a run of kind "scaling": for every scene a series along one of the three axes."""
    spec = {"title": "Made up", "rounds": 3}
    writer = _writer(out, "scaling", scaling.SCHEMA, layout, spec=spec)
    axes = {
        "triangles": [2**k for k in range(10, 24, 2)],
        "pixels": [57600, 230400, 921600, 2073600, 8294400],
        "threads": [1, 2, 3, 4, 8, 16],
    }
    for number, scene in enumerate(layout.scenes):
        axis = list(axes)[number % 3]
        camera = layout.cameras[0]
        for k, x in enumerate(axes[axis]):
            lacking = len(layout.techniques) > 1 and k == 0
            measured = layout.techniques[:-1] if lacking else layout.techniques
            shared = {"build": 1e-6 * x, "raster": 8e-3, "rays": 4e-3, "embree": 0.01 * math.log(x)}
            seconds = {("", stage): s for stage, s in shared.items()}
            for technique in measured:
                for stage in ("prepare", *HYBRID_STAGES):
                    value = 0.001 + 0.05 * _share(technique, stage) * (k + 1) ** 0.3
                    seconds[technique, stage] = value
            arrays = {key: s * np.array([1.0, 1.02, 1.04]) + 1e-9 for key, s in seconds.items()}
            place = {
                "scene": scene, "camera": camera, "width": 1920, "height": 1080, "rays": 2000,
                "triangles": x if axis == "triangles" else 1000, "axis": axis,
                "threads": x if axis == "threads" else 2,
                "label": {"triangles": f"2^{x.bit_length() - 1}", "pixels": "3840x2160"}.get(
                    axis, str(x)),
            }  # fmt: skip
            memory = {"peak_bytes": 2**28 + 100 * x, "program_bytes": 2**27, "scene_bytes": 2**20}
            rows = [
                whole(scaling.SCHEMA, "results", {**place, **memory, "embree_path": "p", **row})
                for row in stages.rows_of(stages.with_sums(arrays, measured), {}, 2000)
            ]
            samples = [
                {"technique": t, "stage": s, "round": r, "phase": "measured", "seconds": v}
                for (t, s), values in arrays.items()
                for r, v in enumerate(values.tolist())
            ]  # fmt: skip
            cell = {"series": f"{scene} along {axis}", "x": x, **place, **memory,
                    "peak_is_of_rounds": True, "embree_path": "p",
                    "compile_seconds": 1.0}  # fmt: skip
            writer.add_cell(cell, samples, rows, [])
    return _done(writer)


def roofline_run(out, layout):
    """Return a run of kind "roofline", with one thread and with two."""
    rates = [
        {"kind": kind, "bytes": 2**k, "threads": threads, "ns_element": 2**k * factor / threads}
        for kind, factor in (("gather", 1e-6), ("chain", 1e-5))
        for k in range(14, 28, 2)
        for threads in (1, 2)
    ]
    caches = [{"name": "L1", "bytes": 32768}, {"name": "L2", "bytes": 2**21}]
    writer = _writer(out, "roofline", roofline.SCHEMA, layout, rates=rates, caches=caches)
    for number, scene, camera, width, height in layout.views():
        rows, samples = [], []
        for threads in (1, 2):
            march = 100 + 200 * _share(scene, camera)
            row = {"technique": "certified", "rays": 1000, "threads": threads, "steps": 20000,
                   "march_ns": march, "start_ns": 40.0, "embree_ns": 250.0,
                   "budget_ns": 120.0 - 140 * (threads == 2 and number == 0)}  # fmt: skip
            for k, name in enumerate(STRUCTURES):
                row |= {f"{name}_bytes": 2 ** (15 + 2 * k) + number, f"{name}_gathered": 5000,
                        f"{name}_places": 2000}  # fmt: skip
            rows.append(whole(roofline.SCHEMA, "results", row))
            times = dict.fromkeys((*roofline.STAGES, *roofline.TIMED_MS), 0.01)
            samples.append({"threads": threads, "round": 0, **times})
        cell = {"scene": scene, "camera": camera, "width": width, "height": height}
        writer.add_cell(cell, samples, rows, [])
    return _done(writer)
