"""The kinds of experiments and what runs each."""

from __future__ import annotations

from collections.abc import Callable

from hybrid_rt_bench.error_run import run_error
from hybrid_rt_bench.peers_run import run_peers
from hybrid_rt_bench.roofline_run import run_roofline
from hybrid_rt_bench.run import Outcome, run_experiment
from hybrid_rt_bench.scaling_run import run_scaling
from hybrid_rt_bench.stability import run_stability

Runner = Callable[..., Outcome]

RUNNERS: dict[str, Runner] = {
    "paper": run_experiment,
    "error": run_error,
    "stability": run_stability,
    "scaling": run_scaling,
    "peers": run_peers,
    "roofline": run_roofline,
}
"""What runs an experiment of each kind of `hybrid_rt_bench.spec.KINDS`.

A runner takes the experiment and, by name, `reporter`, `threads`, `out`, `command` and those
options of the command line that its kind knows and that were given.
"""
