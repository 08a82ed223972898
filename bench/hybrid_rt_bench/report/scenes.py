"""What is to be said of the scenes of a run wherever they are reported.

A scene whose triangles are not all of the model that it is named after has a mark and a note in its
definition; both stand in ``run.json``. A report writes the mark after the scene's name, and the
note beneath whatever shows the scene.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from hybrid_rt_bench.report.table import Table
from hybrid_rt_bench.results.folder import RunData


def scene_name(run: RunData, scene: str) -> str:
    """Return a scene's name as reports write it: with its mark in brackets, if it has one."""
    mark = _marks(run).get(scene, ("", ""))[0]
    return f"{scene} ({mark})" if mark else scene


def scene_notes(run: RunData, scenes: Iterable[str] | None = None) -> list[str]:
    """Return a sentence for each scene that has a note.

    Parameters
    ----------
    run : RunData
    scenes : iterable of str, optional
        Only of these, by their names in the results. Default: of all scenes of the run.
    """
    marks = _marks(run)
    named = marks if scenes is None else dict.fromkeys(s for s in scenes if s in marks)
    return [f"Scene {scene} ({marks[scene][0]}): {marks[scene][1]}." for scene in named]


def with_scene_notes(run: RunData, tables: list[Table]) -> list[Table]:
    """Return the tables, the notes of the scenes that each one shows among its own notes.

    A table that names no scene of the run is of all of them.
    """
    names = [str(entry["name"]) for entry in run.meta.get("scenes", [])]
    for table in tables:
        shown = _named(table, names) or names
        table.notes += [text for text in scene_notes(run, shown) if text not in table.notes]
    return tables


def _marks(run: RunData) -> dict[str, tuple[str, str]]:
    return {
        str(entry["name"]): (str(entry["mark"]), str(entry["note"]))
        for entry in run.meta.get("scenes", [])
        if entry.get("mark")
    }


def _named(table: Table, names: list[str]) -> list[str]:
    text = "\n".join([table.title, *table.notes, *(cell for row in table.rows for cell in row)])
    return [name for name in names if re.search(rf"(?<![\w.-]){re.escape(name)}(?![\w.-])", text)]
