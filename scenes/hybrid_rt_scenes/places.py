"""Where the files of real and imported scenes are kept."""

from __future__ import annotations

import os
from pathlib import Path

from platformdirs import user_data_path

DATA_VARIABLE = "HYBRID_RT_DATA"


def data_directory() -> Path:
    """Return the folder that imported scenes are written to; it may not exist yet.

    It is the one that the environment variable ``HYBRID_RT_DATA`` names, else the user's own, such
    as ``~/.local/share/hybrid-rt`` on Linux.
    """
    return data_directories()[0]


def data_directories() -> tuple[Path, ...]:
    """Return the folders in which files of scenes are looked for, the first that has one first.

    That of ``HYBRID_RT_DATA`` alone, where that is set. Else the user's own; and where this package
    stands in a checkout of the project, ``../shared/scenes`` beside it after that.
    """
    named = os.environ.get(DATA_VARIABLE)
    if named:
        return (Path(named).expanduser().absolute(),)
    checkout = Path(__file__).resolve().parents[2]
    beside = (
        (checkout.parent / "shared" / "scenes",) if (checkout / "pyproject.toml").is_file() else ()
    )
    return (user_data_path("hybrid-rt", appauthor=False), *beside)


def find_file(name: str, folders: tuple[Path, ...]) -> Path | None:
    """Return the path of a file in the first of some folders that has it, or None.

    An absolute path is itself, where there is a file.
    """
    return next((folder / name for folder in folders if (folder / name).is_file()), None)
