"""Try `hybrid-rt compare` on equal programs and on a slow one: ``python bench/compare_aa.py``.

Pairs of runs of the same program follow each other, the last of them beside another process that
spins on one core. None of these pairs may show a change, nor may all first runs beside all second
ones. After each of the first pairs comes a run in which one technique marches a tenth of its rays
twice: beside the second runs of these pairs it must be found slower, in its march and in no other
technique. Exit code 1 if any of this does not hold.
"""

import argparse
import contextlib
import json
import subprocess
import sys
import tempfile
from pathlib import Path

CELLS = (
    "--scenes", "atrium,sphere", "--cameras", "nave,gallery,aisle,front",
    "--resolutions", "640x360",
)  # fmt: skip
SPIN = "while True: pass"
BLOCK = 64  # neighbouring rays that are marched again together


def measure(twice, out, rounds, threads):
    """Run the paper's experiment with a technique that marches a share of its rays `twice`."""
    import numpy as np

    import hybrid_rt as hrt
    from hybrid_rt_bench.cli import main

    again = {}

    class Planted(hrt.Paper):
        """The paper's march, with a share of the rays marched again."""

        name = "planted"
        description = "The paper's march, with some rays marched again"

        def _march(self, rays, screen, any_hit, threads):
            marched = super()._march(rays, screen, any_hit, threads)
            if twice:
                # Chosen once for the rays of a cell: the time to choose them is not the march's.
                if id(rays) not in again:
                    blocks = np.arange(len(rays)) // BLOCK
                    chosen = rays.take(np.flatnonzero(blocks * twice % 1 < twice))
                    again[id(rays)] = rays, chosen
                super()._march(again[id(rays)][1], screen, any_hit, threads)
            return marched

    hrt.register(Planted)
    sys.argv = ["hybrid-rt", "run", "paper", *CELLS, "--techniques", "planted,paper", "--json"]
    sys.argv += ["--rounds", str(rounds), "--out", out]
    sys.argv += ["--threads", str(threads)] if threads else []
    main()


def run(arguments, twice=0.0):
    """Measure in a process of its own, and return the folder of the run."""
    options = ["--one", "--twice", str(twice), "--rounds", str(arguments.rounds)]
    options += ["--out", str(arguments.out)]
    options += ["--threads", str(arguments.threads)] if arguments.threads else []
    done = subprocess.run(
        [sys.executable, __file__, *options], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise SystemExit(f"a run failed:\n{done.stderr}")
    return json.loads(done.stdout)["folder"]


@contextlib.contextmanager
def spinning(wanted):
    """Keep another process busy on one core for a while."""
    process = subprocess.Popen([sys.executable, "-c", SPIN]) if wanted else None
    try:
        yield
    finally:
        if process is not None:
            process.kill()
            process.wait()


def compared(before, after):
    """Return what `hybrid-rt compare --json` says of two sides of runs."""
    done = subprocess.run(
        [sys.executable, "-m", "hybrid_rt_bench", "compare", *before, "--to", *after, "--json"],
        stdout=subprocess.PIPE, text=True, check=True,
    )  # fmt: skip
    return json.loads(done.stdout)


def tell(title, said):
    """Print a comparison in a few lines."""
    print(f"{title}: {said['verdict']}")
    for group in said["groups"]:
        if group["timing"] in ("march", "hybrid"):
            effect = group["effect"]
            low, ratio, high = (100 * (effect[end] - 1) for end in ("low", "ratio", "high"))
            name = f"{group['names']['technique']} {group['timing']}"
            print(f"    {name:16s} {ratio:+6.1f} % ({low:+.1f} to {high:+.1f})")
    sys.stdout.flush()


def planted_is_found(said):
    """Tell whether the march that was made slower is found, and no other technique's time."""
    changes = [(c["names"]["technique"], c["timing"], c["verdict"]) for c in said["changes"]]
    others = [c for c in changes if c[0] != "planted" or c[2] != "slower"]
    return ("planted", "march", "slower") in changes and not others and not said["differences"]


def main():
    """Make the runs, compare them, and say what did not hold."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=6, help="of runs of the same program")
    parser.add_argument("--beside", type=int, default=2, help="of them beside a spinning process")
    parser.add_argument("--planted", type=int, default=4, help="runs with a slower technique")
    parser.add_argument("--twice", type=float, default=0.1, help="share of rays it marches twice")
    parser.add_argument("--rounds", type=int, default=25, help="of each cell")
    parser.add_argument("--threads", type=int, help="of every stage; default: all cores")
    parser.add_argument("--out", help="folder that keeps the runs; default: a temporary one")
    parser.add_argument("--one", action="store_true", help="measure in this process")
    arguments = parser.parse_args()
    if arguments.one:
        measure(arguments.twice, arguments.out, arguments.rounds, arguments.threads)
        return
    with contextlib.ExitStack() as stack:
        if arguments.out is None:
            arguments.out = stack.enter_context(tempfile.TemporaryDirectory())
        raise SystemExit(1 if try_all(arguments) else 0)


def try_all(arguments):
    """Make all runs and return what did not hold, having told it."""
    Path(arguments.out).mkdir(parents=True, exist_ok=True)
    broken, pairs, slower = [], [], []
    for number in range(arguments.pairs):
        beside = number >= arguments.pairs - arguments.beside
        with spinning(beside):
            pairs.append((run(arguments), run(arguments)))
        if len(slower) < arguments.planted:
            slower.append(run(arguments, arguments.twice))
        title = f"pair {number + 1}" + (", beside a spinning process" if beside else "")
        said = compared(pairs[-1][:1], pairs[-1][1:])
        tell(title, said)
        broken += [title] if said["changed"] else []
    said = compared([a for a, _ in pairs], [b for _, b in pairs])
    tell("all pairs together", said)
    broken += ["all pairs together"] if said["changed"] else []
    for k, folder in enumerate(slower):
        tell(f"slower, after pair {k + 1} alone", compared(pairs[k][1:], [folder]))
    if slower:
        title = f"{100 * arguments.twice:g} % of the rays marched twice"
        said = compared([b for _, b in pairs[: len(slower)]], slower)
        tell(title, said)
        broken += [] if planted_is_found(said) else [f"{title}, not found as such"]
    print("does not hold: " + "; ".join(broken) if broken else "all of it holds")
    return broken


if __name__ == "__main__":
    main()
