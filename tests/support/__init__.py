"""What tests of several packages share: where things are, and how another process finds them."""

import os
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
"""The checkout."""

DATA = Path(os.environ.get("HYBRID_RT_DATA", ROOT.parent / "shared" / "scenes"))
"""Where the real scenes are, if they are there."""

PYTHONPATH = os.pathsep.join(map(str, (ROOT, ROOT / "bench", ROOT / "scenes")))
"""What another process needs to import the packages of this checkout."""
