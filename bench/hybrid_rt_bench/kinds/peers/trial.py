"""Try a peer in a process of its own: whether it builds and answers, and in how much memory.

What ends that process, a crash or the limit of time, is a reason and not the end of the run.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import hybrid_rt as hrt
from hybrid_rt_bench.kinds.peers.programs.base import Peer, View

CODE = "from hybrid_rt_bench.kinds.peers.trial import main; main()"
RAYS = 1024


@dataclass(frozen=True)
class Trial:
    """What became of a peer in a process of its own.

    Attributes
    ----------
    reason : str
        Why it cannot run; empty if it can.
    peak_mib : float
        Largest memory of the process less what it had with the scene alone; it holds the peer's
        libraries. NaN where that cannot be known.
    """

    reason: str = ""
    peak_mib: float = float("nan")


def attempt(peer: Peer, scene: hrt.Scene, threads: int, seconds: float) -> Trial:
    """Return whether a peer can take a scene and answer a few rays, or draw a small picture.

    Parameters
    ----------
    peer : Peer
        Registered under its name.
    scene : Scene
    threads : int
    seconds : float
        When to give up.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.npz"
        np.savez(path, vertices=scene.vertices, faces=scene.faces)
        return run_alone(CODE, [peer.name, str(path), str(threads)], seconds)


def run_alone(code: str, arguments: list[str], seconds: float) -> Trial:
    """Return what Python code said of its trial; its last line on stdout is a `Trial` as JSON."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    try:
        done = subprocess.run(
            [sys.executable, "-c", code, *arguments],
            capture_output=True, text=True, timeout=seconds, env=environment, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return Trial(f"given up: not ready after {seconds:g} s")
    if done.returncode < 0:
        return Trial(f"its process was ended by {signal.Signals(-done.returncode).name}")
    if done.returncode:
        said = done.stderr.strip().splitlines() or ["without a word"]
        return Trial(f"its process ended with code {done.returncode}: {said[-1]}")
    return Trial(**json.loads(done.stdout.strip().splitlines()[-1]))


def main() -> None:
    """Try the peer that the command line names, and print what came out."""
    from hybrid_rt_bench.kinds.peers.programs import get_peer
    from hybrid_rt_bench.measure.errors import reason_of

    name, path, threads = sys.argv[1:]
    with np.load(path) as arrays:
        scene = hrt.Scene.from_arrays(arrays["vertices"], arrays["faces"])
    before = _reset_peak()
    try:
        _try(get_peer(name), scene, int(threads))
    except Exception as error:
        found = Trial(reason_of(error))
    else:
        peak = _peak_mib()
        found = Trial("", peak - before)
    print(json.dumps({"reason": found.reason, "peak_mib": found.peak_mib}))
    sys.stdout.flush()
    os._exit(0)  # what a library does at its end is not on trial


def _try(peer: Peer, scene: hrt.Scene, threads: int) -> None:
    opened = peer.open(scene, threads)
    low, high = scene.bounds
    if peer.raster:
        camera = hrt.Camera.look_at(
            high + (high - low), low, (0.0, 1.0, 1e-3), width=64, height=48,
            near=1e-3 * scene.diagonal,
        )  # fmt: skip
        drawing = opened.draw(camera)
        drawing.draw()
        drawing.read()
        return
    rng = np.random.default_rng(1)
    n = 1 if peer.sampled else RAYS
    rays = hrt.Rays.from_arrays(rng.uniform(low, high, (n, 3)), rng.normal(size=(n, 3)))
    query = opened.load(View("trial", rays))
    if query is not None:
        query.answers(query.run())


def _reset_peak() -> float:
    """Forget the largest memory so far and return the present one in MiB, NaN without /proc."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return float("nan")
    return _peak_mib()


def _peak_mib() -> float:
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:
        return float("nan")
    return float(next(line for line in lines if line.startswith("VmHWM")).split()[1]) / 1024
