"""Reads and writes contacts that other tools made; each set of four is one grasp to judge."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from grasp_core.arrays import Array, Shape
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError, about
from grasp_core.files.json_text import json_of
from grasp_core.files.text_files import read_text
from grasp_core.planning.grasps_json import Overrides, contact_sets_from_json
from grasp_core.values import FINGERS

NO_FRICTION = 1.0
"""Friction put in for files that state none; it is never used, because a dataset's configuration
has its own."""


@declared
class GraspToJudge(Declared):
    """Four contacts made by another tool, in the object's frame."""

    id: str
    """Name that this package gives the grasp, which may be part of a file name."""
    name: str
    """Name that the other tool's file gives the grasp."""
    points: Annotated[Array, Shape(FINGERS, 3)]
    """Contact points, (4, 3) [m]."""
    normals: Annotated[Array, Shape(FINGERS, 3)]
    """Unit vectors into the object, (4, 3)."""


def read_given(path: Path, *, outward: bool = False) -> tuple[GraspToJudge, ...]:
    """Read contacts made by other tools."""
    text = read_text(path)
    with about(path):
        return given_from_json(text, outward=outward)


def given_text(given: Sequence[GraspToJudge]) -> str:
    """Write given grasps as a contacts file, with normals into the object."""
    grasps = [
        {
            "id": grasp.name,
            "contacts": [
                {"position_m": point.tolist(), "normal": normal.tolist()}
                for point, normal in zip(grasp.points, grasp.normals, strict=True)
            ],
        }
        for grasp in given
    ]
    return json.dumps({"grasps": grasps}, indent=1) + "\n"


def given_from_json(text: str, *, outward: bool = False) -> tuple[GraspToJudge, ...]:
    """Parse contacts to judge from the text of a contacts file."""
    sets = contact_sets_from_json(text, Overrides(NO_FRICTION, outward=outward))
    stated = json_of(text)
    planned = "schema" in stated  # graspproof planned these, and they may be judged at any friction
    remedy = "friction: remove it from the contacts file, because a dataset has its own frictions"
    if not planned and "friction" in stated:
        raise InputError(remedy)
    for row, each in enumerate(sets):
        if not planned and (each.friction != NO_FRICTION).any():
            raise InputError(f"grasps[{row}] ({each.id}): {remedy}")
        if len(each.positions) != FINGERS:
            raise InputError(
                f"grasps[{row}] ({each.id}): expected 4 contacts, got {len(each.positions)}"
            )
    return tuple(
        GraspToJudge(f"given-{i:06}", each.id, each.positions, each.normals)
        for i, each in enumerate(sets)
    )
