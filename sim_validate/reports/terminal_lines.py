"""Writes what pytest's terminal says at the end about meshes, grasps that pass, and baselines.

A grasp has a line of its own here only if it passes and is not what it was; failures speak for
themselves.
"""

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

Line: TypeAlias = Mapping[str, Any]
MOST_TOLD = 40
"""Largest number of grasps that are listed for one mesh."""


def sections(lines: Sequence[Line]) -> list[tuple[str, list[str]]]:
    """Write the sections of the terminal, each a title and at least one line."""
    notes = sorted({line["mesh_note"] for line in lines if line["mesh_note"]})
    meshes = [text for note in notes for text in (note, *_told(lines, note, "  "))]
    found = [
        ("meshes of grasps", meshes),
        ("grasps that are better", _told(lines, "", "")),
        ("baselines of grasps", sorted({line["wrote"] for line in lines if line["wrote"]})),
    ]
    return [(title, texts) for title, texts in found if texts]


def _told(lines: Sequence[Line], note: str, indent: str) -> list[str]:
    """List the grasps on a mesh that pass and are not what they were."""
    said = sorted({line["told"] for line in lines if line["told"] and line["mesh_note"] == note})
    more = len(said) - MOST_TOLD
    cut = [f"and {more} more; --grasp-report DIR lists all"] if more > 0 else []
    return [f"{indent}{text}" for text in (*said[:MOST_TOLD], *cut)]
