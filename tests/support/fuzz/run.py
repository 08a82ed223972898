"""Junk at every argument of every public callable, in processes that may die of it."""

import json
import os
import queue
import random
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from support import PYTHONPATH, ROOT
from support.fuzz import examples, junk
from support.fuzz.targets import targets

PATIENCE = 20.0
"""Seconds that one call may take. The first calls of a process load kernels that are compiled."""

FIRST = 300.0
"""Seconds for the first call, which may have to compile everything."""


@dataclass(frozen=True)
class Call:
    """One argument of one callable, and the junk in its place."""

    label: str
    parameter: str
    junk: str

    def __str__(self) -> str:
        return f"{self.label}({self.parameter}={self.junk})"


@dataclass(frozen=True)
class Ended:
    """How a call ended: "refused", "accepted", "bare", "crash", "hang"."""

    call: Call
    outcome: str

    @property
    def fault(self) -> bool:
        """Whether nobody should see this."""
        return not self.outcome.startswith(("refused", "accepted", "not for"))


def calls() -> Iterator[Call]:
    """Yield all calls there are."""
    for target in targets():
        for parameter, valid in examples.arguments(target.label, target.get()).items():
            for label in junk.labels(valid):
                yield Call(target.label, parameter, label)


def extremes(seeds: range) -> list[Call]:
    """Return calls that try allowed but extreme scenes, views and rays, one for each seed."""
    return [Call("extremes", "seed", str(seed)) for seed in seeds]


def sample(everything: list[Call], share: float, seed: int) -> list[Call]:
    """Return a share of the calls, some of every argument."""
    rng = random.Random(seed)
    by_argument: dict[tuple[str, str], list[Call]] = {}
    for call in everything:
        by_argument.setdefault((call.label, call.parameter), []).append(call)
    chosen = []
    for group in by_argument.values():
        chosen += rng.sample(group, max(1, round(share * len(group))))
    return chosen


class _Process:
    """One process that calls; what it says arrives in a queue."""

    def __init__(self) -> None:
        self._errors: list[str] = []
        paths = os.pathsep.join((PYTHONPATH, str(ROOT / "tests")))
        self._child = subprocess.Popen(
            [sys.executable, "-X", "faulthandler", str(Path(__file__).with_name("call.py"))],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env=os.environ | {"PYTHONPATH": paths}, cwd=ROOT,
        )  # fmt: skip
        self._said: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._threads = [threading.Thread(target=f, daemon=True) for f in (self._read, self._drain)]
        for thread in self._threads:
            thread.start()
        self.calls = 0

    def _read(self) -> None:
        assert self._child.stdout is not None
        for line in self._child.stdout:
            self._said.put(line.rstrip("\n"))
        self._said.put(None)

    def _drain(self) -> None:
        assert self._child.stderr is not None
        self._errors.extend(self._child.stderr)

    def call(self, call: Call) -> str:
        """Return the outcome of one call."""
        assert self._child.stdin is not None
        wanted = {"number": self.calls} | vars(call)
        try:
            self._child.stdin.write(json.dumps(wanted) + "\n")
            self._child.stdin.flush()
        except BrokenPipeError:
            return self._death()
        patience = FIRST if self.calls == 0 else PATIENCE
        end = f"end {self.calls} "
        self.calls += 1
        while True:
            try:
                line = self._said.get(timeout=patience)
            except queue.Empty:
                self.stop()
                return "hang"
            if line is None:
                return self._death()
            if line.startswith(end):
                return line.removeprefix(end)

    def _death(self) -> str:
        code = self._child.wait()
        for thread in self._threads:
            thread.join(5)
        text = " | ".join(line.strip() for line in self._errors[-12:])
        return f"crash, exit code {code}: {text[:400]}"

    def stop(self) -> None:
        """End the process."""
        self._child.kill()
        self._child.wait()


def fuzz(chosen: list[Call]) -> list[Ended]:
    """Return how each call ended."""
    ended = []
    process = _Process()
    for call in chosen:
        outcome = process.call(call)
        ended.append(Ended(call, outcome))
        if outcome.startswith(("crash", "hang")):
            process.stop()
            process = _Process()
    process.stop()
    return ended
