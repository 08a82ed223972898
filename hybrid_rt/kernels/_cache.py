"""Compiled code on disk: what is loaded fits the sources, and is whole.

Numba's own cache looks at the file of the function that is called and at nothing that it calls;
it refuses to import where no folder can be written; a damaged file is an error, or worse. Here a
file is named after a digest of all kernels' sources and begins with a digest of what follows, and
one that is missing or damaged is compiled anew. Files lie in NUMBA_CACHE_DIR, if that is set; else
they are written to the first that can be written of the package's ``__pycache__`` and the user's
cache folder, and read from both.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import inspect
import os
import pickle
import sys
import tempfile
import uuid
import warnings
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba import types
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from hybrid_rt.kernels import _progress

KERNELS = Path(__file__).parent
SUFFIX = ".code"
DIGEST = hashlib.sha256().digest_size


def _hash(*parts: object) -> str:
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:20]


@functools.cache
def sources() -> str:
    """Return the digest of the sources of all kernels, and of the versions that compile them."""
    found = hashlib.sha256()
    for path in sorted(KERNELS.rglob("*.py")):
        found.update(path.relative_to(KERNELS).as_posix().encode() + b"\0")
        found.update(path.read_bytes() + b"\0")
    versions = numba.__version__, llvmlite.__version__, sys.version_info[:3]
    return _hash(found.hexdigest(), versions)


@functools.cache
def _file_digest(path: str) -> str:
    """Return the digest of a kernel's own file, which need not be one of this package."""
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError:
        return path


@functools.cache
def folders() -> tuple[Path, ...]:
    """Return where compiled code may lie."""
    package = KERNELS.parent
    if numba.config.CACHE_DIR:
        return (Path(numba.config.CACHE_DIR) / f"hybrid_rt-{_hash(str(package))}",)
    found = [package / "__pycache__" / "compiled"]
    users = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    with contextlib.suppress(RuntimeError):  # no home
        home = Path(users) if users else Path.home() / ".cache"
        found.append(home / "hybrid_rt" / _hash(str(package)))
    return tuple(found)


@functools.cache
def writable_folder() -> Path | None:
    """Return the first of `folders` that can be written; warn and return None if there is none."""
    for folder in folders():
        with contextlib.suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return folder
    warnings.warn(
        "hybrid_rt compiles anew in every process, since no folder for compiled code can be "
        f"written: {', '.join(map(str, folders()))}. Set NUMBA_CACHE_DIR to one that can.",
        RuntimeWarning,
        stacklevel=2,
    )
    return None


class KernelCache:
    """The cache of one function, as Numba's dispatchers use it."""

    def __init__(self, function: Any) -> None:
        self._name = f"{function.__module__}.{function.__qualname__}".removeprefix(
            "hybrid_rt.kernels."
        )
        self._file = inspect.getfile(function)
        self._enabled = True

    @property
    def cache_path(self) -> str:
        """The folder that files are written to."""
        return str(writable_folder())

    def enable(self) -> None:
        """Load and save from now on."""
        self._enabled = True

    def disable(self) -> None:
        """Neither load nor save from now on."""
        self._enabled = False

    def flush(self) -> None:
        """Remove all files of this function."""
        for folder in folders():
            for path in folder.glob(f"{self._name}-*{SUFFIX}"):
                with contextlib.suppress(OSError):
                    path.unlink()

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what was compiled for a signature, or None."""
        target_context.refresh()
        if self._enabled:
            stem, digest = self._key(sig, target_context.codegen())
            for folder in folders():
                found = self._read(folder / f"{stem}.{digest}{SUFFIX}", target_context)
                if found is not None:
                    return found
        _progress.begin(self._name)
        return None

    def save_overload(self, sig: Any, compiled: Any) -> None:
        """Keep what was compiled for a signature; other versions of it go."""
        _progress.end(self._name)
        folder = writable_folder() if self._enabled else None
        if folder is None or compiled.library.has_dynamic_globals:
            return
        stem, digest = self._key(sig, compiled.codegen)
        data = dumps(compiled._reduce())
        with contextlib.suppress(OSError):  # a full disk must not stop a picture
            path = folder / f"{stem}.{digest}{SUFFIX}"
            new = folder / f"{uuid.uuid4().hex}.new"
            new.write_bytes(hashlib.sha256(data).digest() + data)
            new.replace(path)
            for other in folder.glob(f"{stem}.*{SUFFIX}"):
                if other != path:
                    other.unlink()

    def _read(self, path: Path, target_context: Any) -> Any:
        try:
            content = path.read_bytes()
        except OSError:
            return None
        if hashlib.sha256(content[DIGEST:]).digest() != content[:DIGEST]:
            return None
        return CompileResult._rebuild(target_context, *pickle.loads(content[DIGEST:]))

    def _key(self, sig: Any, codegen: Any) -> tuple[str, str]:
        """Return what names a function for a signature and a machine, and its sources' digest."""
        classes = [kind.instance_class for kind in sig if isinstance(kind, types.BaseNamedTuple)]
        names = [f"{made.__module__}.{made.__qualname__}" for made in classes]
        stem = f"{self._name}-{_hash(str(sig), names, codegen.magic_tuple())}"
        # The numbers of a technique from elsewhere bring its march, which is beside their class.
        files = [inspect.getfile(made) for made in classes]
        return stem, _hash(sources(), *map(_file_digest, [self._file, *files]))
