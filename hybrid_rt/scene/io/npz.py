"""NumPy's .npz archives, whose sizes are known before anything is unpacked."""

from __future__ import annotations

import math
import warnings
import zipfile
import zlib
from lzma import LZMAError
from typing import Any

from numpy.lib import format as npy
from numpy.typing import NDArray

from hybrid_rt.scene.io.fault import Budget, FormatError

NAMES = ("vertices", "faces", "object_id", "polygon_id")
_BROKEN = (zipfile.BadZipFile, zlib.error, LZMAError, EOFError, OSError, NotImplementedError)


def read(path: Any, budget: Budget) -> dict[str, NDArray[Any]]:
    """Return the arrays of a mesh, as they are stored."""
    if not zipfile.is_zipfile(path):
        raise FormatError("truncated, or not an .npz archive at all")
    try:
        with zipfile.ZipFile(path) as archive:
            members = {info.filename: info for info in archive.infolist()}
            held = [name.removesuffix(".npy") for name in members]
            missing = [name for name in NAMES[:2] if name not in held]
            if missing:
                listed = ", ".join(held) or "nothing"
                lacking = " nor ".join(map(repr, missing))
                raise FormatError(f"no array {lacking} (it holds {listed})")
            return {
                name: _member(archive, members[f"{name}.npy"], budget)
                for name in NAMES
                if f"{name}.npy" in members
            }
    except _BROKEN as error:
        raise FormatError(f"truncated or corrupt .npz archive ({error})") from error


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo, budget: Budget) -> NDArray[Any]:
    name = info.filename
    if info.flag_bits & 1:
        raise FormatError(f"{name}: encrypted, which cannot be read")
    budget.spend(info.file_size, name)
    with archive.open(info) as file:
        try:
            version = npy.read_magic(file)
            if version not in ((1, 0), (2, 0)):
                raise ValueError(f"version {version} of the .npy format")
            header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of headers that Python 2 wrote
                shape, _, dtype = header(file)
        except (ValueError, SyntaxError, RecursionError, MemoryError) as error:
            raise FormatError(f"{name}: not a plain numeric array ({error})") from error
        if dtype.hasobject:
            raise FormatError(
                f"{name}: holds Python objects, which are never read (allow_pickle=False)"
            )
        stated = math.prod(shape) * dtype.itemsize
        left = info.file_size - file.tell()
        if min(shape, default=0) < 0 or stated != left:
            raise FormatError(
                f"{name}: truncated or corrupt: its header says shape {shape} and dtype {dtype}, "
                f"{stated} bytes, and {left} bytes follow it"
            )
    with archive.open(info) as file:
        return npy.read_array(file, allow_pickle=False)
