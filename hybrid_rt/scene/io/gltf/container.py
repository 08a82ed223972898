"""Where a glTF file keeps its JSON and its bytes: .gltf, .glb, files beside it, data: uris."""

from __future__ import annotations

import base64
import binascii
import re
import urllib.parse
from pathlib import Path

from hybrid_rt.scene.io.fault import Budget, FormatError
from hybrid_rt.scene.io.gltf.tree import At, parse

# Extensions that a file may require: read here, or of no consequence to triangles.
_READ = {
    "KHR_mesh_quantization", "EXT_mesh_gpu_instancing", "KHR_draco_mesh_compression",
    "EXT_meshopt_compression", "KHR_meshopt_compression", "KHR_node_visibility",
}  # fmt: skip
_HARMLESS = {
    "MSFT_packing_normalRoughnessMetallic", "MSFT_packing_occlusionRoughnessMetallic",
    "KHR_xmp", "KHR_xmp_json_ld", "KHR_animation_pointer", "KHR_techniques_webgl",
    "KHR_technique_webgl",
    "KHR_node_hoverability", "KHR_node_selectability", "EXT_mesh_features",
    "EXT_structural_metadata", "EXT_mesh_manifold", "ADOBE_materials_thin_transparency",
    "GODOT_single_root",
}  # fmt: skip
_LOOKS = tuple(
    f"{who}_{what}" for who in ("KHR", "EXT", "MSFT") for what in ("materials", "texture", "lights")
)


def open_file(path: Path, data: bytes) -> tuple[At, bytes | None]:
    """Return the tree of a file, checked for what this reader must know, and its binary chunk."""
    binary = None
    if data[:4] == b"glTF":
        data, binary = _chunks(data)
    elif path.suffix.lower() == ".glb":
        raise FormatError("truncated, or not a .glb file: it does not begin with 'glTF'")
    tree = parse(data)
    asset = tree.need("asset")
    for key in ("version", "minVersion"):
        version = asset.get(key)
        if version is None:
            if key == "version":
                asset.need(key)
            continue
        if not re.fullmatch(r"2\.\d+", version.text()) or (
            key == "minVersion" and version.text() != "2.0"
        ):
            raise version.fault(f"glTF {version.text()!r} cannot be read, only 2.0")
    unknown = [
        name.text()
        for name in tree.all("extensionsRequired")
        if not (name.text() in _READ | _HARMLESS or name.text().startswith(_LOOKS))
    ]
    if unknown:
        raise FormatError(
            f"it requires {', '.join(unknown)}, which cannot be read; store it without"
        )
    return tree, binary


def _chunks(data: bytes) -> tuple[bytes, bytes | None]:
    version, stated = (int.from_bytes(data[k : k + 4], "little") for k in (4, 8))
    if version != 2:
        raise FormatError(f"binary glTF of version {version} cannot be read, only 2")
    if stated != len(data):
        raise FormatError(
            f"truncated or corrupt: the header says {stated} bytes, it has {len(data)}"
        )
    chunks: list[tuple[bytes, bytes]] = []
    at = 12
    while at < len(data):
        length, kind = int.from_bytes(data[at : at + 4], "little"), data[at + 4 : at + 8]
        if at + 8 + length > len(data):
            raise FormatError(
                f"truncated: a chunk of {length} bytes, {len(data) - at - 8} are left"
            )
        chunks.append((kind, data[at + 8 : at + 8 + length]))
        at += 8 + length
    if not chunks or chunks[0][0] != b"JSON":
        raise FormatError("corrupt: the first chunk is not JSON")
    binary = chunks[1][1] if len(chunks) > 1 and chunks[1][0] == b"BIN\0" else None
    return chunks[0][1], binary


def read_buffer(path: Path, buffer: At, binary: bytes | None, budget: Budget) -> bytes:
    """Return the bytes of a buffer, as many as it says."""
    length = buffer.need("byteLength").integer(1)
    uri = buffer.get("uri")
    if uri is not None:
        data = _open(path, uri, budget)
    elif binary is not None and buffer.place == "buffers[0]":
        data = binary
    else:
        raise buffer.fault("no uri, and no binary chunk")
    if len(data) < length:
        raise buffer.fault(f"truncated: it says {length} bytes, there are {len(data)}")
    return data[:length]


def _open(path: Path, uri: At, budget: Budget) -> bytes:
    text = uri.text()
    if text[:5].lower() == "data:":
        return _data(uri, text)
    shown = text if len(text) <= 80 else text[:77] + "..."
    if re.match(r"[A-Za-z][A-Za-z0-9+.\-]*:", text):
        raise uri.fault(f"{shown!r}: no other scheme than data: is followed")
    name = urllib.parse.unquote(text)
    if name.startswith("/") or "\\" in name or "\0" in name or re.match("[A-Za-z]:", name):
        raise uri.fault(f"{shown!r}: expected a relative path with slashes")
    if ".." in name.split("/"):
        raise uri.fault(f"{shown!r}: leads out of the file's folder")
    folder = path.parent.resolve()
    try:
        target = (folder / name).resolve()
        if not target.is_relative_to(folder):
            raise uri.fault(f"{shown!r}: leads out of the file's folder")
        if not target.is_file():
            raise uri.fault(f"{shown!r}: no such regular file beside it")
        budget.spend(target.stat().st_size, uri.place)
        return target.read_bytes()
    except (OSError, RuntimeError, ValueError) as error:  # names too long, loops of links
        raise uri.fault(f"{shown!r}: {getattr(error, 'strerror', None) or error}") from error


def _data(uri: At, text: str) -> bytes:
    head, comma, body = text.partition(",")
    if not comma:
        raise uri.fault("a data: uri without data")
    raw = urllib.parse.unquote_to_bytes(body)
    if not head.lower().endswith(";base64"):
        return raw
    raw = bytes(raw).translate(None, b" \t\r\n")
    try:
        return base64.b64decode(raw + b"=" * (-len(raw) % 4), validate=True)
    except binascii.Error as error:
        raise uri.fault(f"corrupt base64 ({error})") from error
