"""In what the machines of two runs differ."""

from __future__ import annotations

from hybrid_rt_bench.results.folder import RunData


def differences(a: RunData, b: RunData) -> list[str]:
    """Return a sentence for each thing that should be the same and is not."""
    found = []
    for key in ("cpu", "threads", "os"):
        was, now = a.meta["environment"][key], b.meta["environment"][key]
        if was != now:
            found.append(f"The runs differ in {key}: {was} and {now}.")
    return found
