"""Read every small mesh of public collections and compare with other readers.

Run ``python tests/corpus/corpus.py NAME=FOLDER ...`` from the root, each FOLDER a checkout of a
public repository, such as mikedh/trimesh or assimp/assimp. The list goes to
``tests/corpus/results.csv``, a summary to ``docs/results/corpus.md``; the meshes themselves are
never kept here. Needs the extras ``corpus``, ``draco`` and ``meshopt``.

A file agrees when the triangles, the area and the bounds are those of one other reader at least,
and of all that read it: where one differs, ``explained.csv`` says who is right, and why; else the
file counts as differing.
"""

import csv
import functools
import json
import subprocess
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import second

import hybrid_rt as hrt

HERE = Path(__file__).resolve().parent
RESULTS = HERE / "results.csv"
SUMMARY = HERE.parents[1] / "docs" / "results" / "corpus.md"
EXPLAINED = HERE / "explained.csv"
SUFFIXES = (".obj", ".ply", ".stl", ".gltf", ".glb")
LARGEST = 20 << 20
COLUMNS = (
    "collection",
    "file",
    "triangles",
    "area",
    "bounds",
    "verdict",
    "by",
    "against",
    "reason",
)
VERDICTS = ("agrees", "explained", "differs", "refused")
CLOSE = 2e-5  # of the area, and of the diagonal: some readers transform in float32


def small_meshes(folder):
    """Return the mesh files below a folder, in the order of their names."""
    found = [p for p in sorted(folder.rglob("*")) if p.suffix.lower() in SUFFIXES and p.is_file()]
    return [p for p in found if p.stat().st_size <= LARGEST]


def ours(path):
    """Return what this project reads, measured, or its refusal."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            mesh = hrt.read_mesh(path)
        except hrt.MeshFileError as error:
            return {"error": str(error).removeprefix(f"{path}: ")}
    return second.measured(mesh.vertices[mesh.faces])


def another(reader, path):
    """Return what another reader reads."""
    words = [sys.executable, str(HERE / "second.py"), reader, str(path)]
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
        return json.loads(done.stdout.splitlines()[-1])
    except (subprocess.TimeoutExpired, IndexError, ValueError):
        return {"error": "it died"}


def same(a, b):
    """Return whether two measurements are of the same triangles."""
    if a.get("triangles") != b.get("triangles"):
        return False
    low_high = list(zip(a["bounds"], b["bounds"], strict=True))
    diagonal = sum((a["bounds"][k] - a["bounds"][k + 3]) ** 2 for k in range(3)) ** 0.5
    near = max(abs(x - y) for x, y in low_high) <= CLOSE * diagonal
    return near and abs(a["area"] - b["area"]) <= CLOSE * max(a["area"], diagonal**2 * 1e-3)


def brief(found):
    """Return a measurement in a few words."""
    return found.get("error") or f"{found['triangles']} triangles, area {found['area']:.6g}"


def compare(name, folder, path, explained):
    """Return the row of one file."""
    row = dict.fromkeys(COLUMNS, "")
    row |= {"collection": name, "file": path.relative_to(folder).as_posix()}
    mine = ours(path)
    if "error" in mine:
        return row | {"verdict": "refused", "reason": mine["error"]}
    row |= {
        "triangles": mine["triangles"],
        "area": f"{mine['area']:.6g}",
        "bounds": " ".join(f"{x:.6g}" for x in mine["bounds"]),
    }
    others = {reader: another(reader, path) for reader in second.READERS}
    agree = [reader for reader, found in others.items() if same(mine, found)]
    differ = {r: f for r, f in others.items() if r not in agree and "error" not in f}
    row["against"] = "; ".join(f"{reader}: {brief(found)}" for reader, found in differ.items())
    told = explained.get((name, row["file"]), "")
    if told or not differ:
        row["reason"] = told if differ or not agree else ""
        if agree:
            return row | {"verdict": "agrees", "by": " ".join(agree)}
        if told:
            return row | {"verdict": "explained"}
    said = "; ".join(f"{reader}: {brief(found)}" for reader, found in others.items())
    return row | {"verdict": "differs", "by": " ".join(agree), "reason": said}


def explanations():
    """Return reasons by collection and file."""
    with EXPLAINED.open(newline="") as file:
        return {(r["collection"], r["file"]): r["reason"] for r in csv.DictReader(file)}


def rows(collections, jobs=2):
    """Return the rows of all files."""
    explained = explanations()
    made = []
    for name, folder in collections.items():
        row = functools.partial(compare, name, folder, explained=explained)
        with ThreadPoolExecutor(jobs) as pool:
            made += pool.map(row, small_meshes(folder))
    return made


def counted(made):
    """Return (collection, files, of each verdict) for each collection."""
    counts = []
    for name in dict.fromkeys(row["collection"] for row in made):
        here = [row["verdict"] for row in made if row["collection"] == name]
        counts.append((name, len(here), *(here.count(verdict) for verdict in VERDICTS)))
    return counts


def summary(made):
    """Return the page about a list."""
    lines = [
        "# Mesh files of public collections",
        "",
        "Every mesh of up to 20 MB in each collection, read by this library and by trimesh, assimp",
        "and meshio, and compared: triangles, area, bounds. Made by `make corpus` (see",
        "`tests/corpus/corpus.py`); all files are in `tests/corpus/results.csv`.",
        "",
        "| collection | files | " + " | ".join(VERDICTS) + " |",
        "|---|" + "---:|" * (1 + len(VERDICTS)),
        *("| " + " | ".join(map(str, row)) + " |" for row in counted(made)),
        "",
        "*agrees*: with one of the others at least. *explained*: with none of them, for a reason.",
        "These are the reasons, and those why one of the others differs where another agrees:",
        "",
    ]
    told = [row for row in made if row["verdict"] != "refused" and row["reason"]]
    lines += [f"- `{row['collection']}/{row['file']}`: {row['reason']}" for row in told]
    lines += ["", "*refused*, with the reader's own words:", ""]
    refused = [row for row in made if row["verdict"] == "refused"]
    lines += [f"- `{row['collection']}/{row['file']}`: {row['reason']}" for row in refused]
    return "\n".join(lines) + "\n"


def main(words):
    """Write the list and a summary; return 1 when a file differs from all readers, unexplained."""
    collections = {name: Path(folder) for name, _, folder in (w.partition("=") for w in words)}
    made = rows(collections)
    with RESULTS.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(made)
    SUMMARY.parent.mkdir(exist_ok=True)
    SUMMARY.write_text(summary(made))
    for name, files, *counts in counted(made):
        print(name, files, *(f"{v} {n}" for v, n in zip(VERDICTS, counts, strict=True)))
    differing = [r for r in made if r["verdict"] == "differs"]
    for row in differing:
        mine = f"{row['triangles']} triangles, area {row['area']}"
        print(f"{row['collection']}/{row['file']}: {mine}; {row['reason']}")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
