"""Settings of the whole suite.

Properties are tried on the same examples each time; ``HYPOTHESIS_PROFILE=explore``: on new ones.
"""

import os
import signal

import pytest
from hypothesis import settings

from support import DATA

settings.register_profile("same", derandomize=True)
settings.register_profile("explore", derandomize=False)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "same"))

# What somebody has imported on this machine is no part of the suite.
os.environ.setdefault("HYBRID_RT_DATA", str(DATA))

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell has it ignored in what it starts in the background, and whatever a test starts would
    # inherit that. A handler of our own is not inherited: what is started stops as it should.
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Count all tests on real scenes among the slow ones."""
    for item in items:
        if item.path.stem.endswith("real_scenes"):
            item.add_marker(pytest.mark.slow)
