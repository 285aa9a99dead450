"""Reads `grasps.json`; every error message names the file."""

from collections.abc import Iterable
from pathlib import Path

from grasp_core.errors import InputError, about
from grasp_core.files.text_files import read_text
from grasp_core.planning.result import Plan
from grasp_core.records.grasps_json import grasps_from_json
from grasp_core.values import Grasp

GRASPS = "grasps.json"
"""Name of the file in a folder of results."""
NAMED = 5
"""Largest number of names that a message lists."""


def read_grasps(path: Path) -> Plan:
    """Read the grasps of a `grasps.json`."""
    text = read_text(path)
    with about(path):
        return grasps_from_json(text)


def grasp_with_id(path: Path, saved: Plan, wanted: str | None) -> Grasp:
    """Find the grasp with an id; the id may be left out if the file has one grasp only."""
    if wanted is None and len(saved.grasps) == 1:
        return saved.grasps[0]
    found = next((grasp for grasp in saved.grasps if grasp.id == wanted), None)
    if found is None:
        asked = (
            "choose a grasp with --grasp ID" if wanted is None else f"no grasp is named {wanted}"
        )
        raise InputError(
            f"{path}: {asked}; the file has {some(grasp.id for grasp in saved.grasps)}"
        )
    return found


def some(names: Iterable[str]) -> str:
    """List the first few of many names for a message."""
    listed = list(names)
    more = f" and {len(listed) - NAMED} more" if len(listed) > NAMED else ""
    return (", ".join(listed[:NAMED]) or "none") + more
