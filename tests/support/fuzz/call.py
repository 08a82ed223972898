"""Call what standard input lists, one call after another, and tell before and after each.

Started by ``support.fuzz.run``: in comes a line of JSON {"number", "label", "parameter", "junk"} a
call, out go "start N" before it and "end N OUTCOME" after it, so a crash and a hang have a name.
"""

import json
import resource
import sys
import traceback
import warnings
from collections.abc import Callable
from typing import Any

import hybrid_rt as hrt
from support.fuzz import examples, extremes, junk
from support.fuzz.targets import targets
from support.fuzz.uses import use

MEMORY = 12 << 30  # bytes of addresses: what asks for more is told so, the machine goes on


def where(error: BaseException) -> str:
    """Return the place that raised, from the project's last frame."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [f for f in frames if "/hybrid_rt/" in f.filename] or frames
    return f"{ours[-1].filename.rpartition('/hybrid_rt/')[2]}:{ours[-1].lineno}"


def outcome(target: Any, parameter: str, label: str) -> str:
    """Return how one call with one argument of junk ended."""
    function = target.get()
    valid = examples.arguments(target.label, function)
    try:
        value = junk.value(label, valid[parameter])
    except (ValueError, TypeError, RuntimeWarning):
        return "not for this argument"
    return ended(lambda: use(function(**valid | {parameter: value})))


def ended(call: Callable[[], None]) -> str:
    """Return how a call ended."""
    try:
        call()
    except hrt.HybridRTError as error:
        str(error)
        return f"refused: {type(error).__name__}"
    except BaseException as error:
        text = " ".join(str(error).split())[:160]
        return f"bare: {type(error).__name__}: {text} ({where(error)})"
    return "accepted"


def main() -> None:
    """Do what standard input says."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    warnings.simplefilter("error", RuntimeWarning)
    known = {target.label: target for target in targets()}
    for line in sys.stdin:
        wanted = json.loads(line)
        number = wanted["number"]
        print(f"start {number}", flush=True)
        if wanted["label"] == "extremes":
            told = ended(lambda seed=wanted["junk"]: extremes.try_all(int(seed)))
        else:
            told = outcome(known[wanted["label"]], wanted["parameter"], wanted["junk"])
        print(f"end {number} {told}", flush=True)


if __name__ == "__main__":
    main()
