"""Reads contacts made by other tools, from JSON or npz; each set of four is one grasp to judge."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grasp_core.errors import InputError
from grasp_core.files.json_text import value_of
from grasp_core.files.text_files import read_bytes, text_of
from grasp_core.records.contacts_json import Overrides, contact_sets_from_json
from grasp_core.values import FINGERS
from sim_validate.files.npz import arrays_of

POINTS, NORMALS, NAMES = "contact_points_m", "contact_normals", "grasp_id"
"""Names of the arrays of an npz file: points (n, 4, 3) [m], normals (n, 4, 3), optionally names
(n,)."""
NO_FRICTION = 1.0
"""Friction put in for files that state none; it is never used, because a dataset's configuration
has its own."""

Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class GivenGrasp:
    """Four contacts made by another tool, in the object's frame."""

    id: str
    """Name that this package gives the grasp, which may be part of a file name."""
    name: str
    """Name that the other tool's file gives the grasp."""
    points: tuple[Triple, ...]
    """Contact points, (4, 3) [m]."""
    normals: tuple[Triple, ...]
    """Unit vectors into the object, (4, 3)."""


def read_given(path: Path, *, outward: bool = False) -> tuple[GivenGrasp, ...]:
    """Read contacts made by other tools."""
    try:
        data = read_bytes(path)
        text = contacts_text(data) if path.suffix == ".npz" else text_of(data)
        return given_from_json(text, outward=outward)
    except InputError as error:
        raise InputError(f"{path}: {str(error).removeprefix(f'{path}: ')}") from error


def given_text(given: Sequence[GivenGrasp]) -> str:
    """Write given grasps as a contacts file, with normals into the object."""
    grasps = [
        {
            "id": grasp.name,
            "contacts": [
                {"position_m": point, "normal": normal}
                for point, normal in zip(grasp.points, grasp.normals, strict=True)
            ],
        }
        for grasp in given
    ]
    return json.dumps({"grasps": grasps}, indent=1) + "\n"


def given_sha256(given: Sequence[GivenGrasp]) -> str:
    """Hash the names and numbers of given grasps."""
    return hashlib.sha256(json.dumps([astuple(grasp) for grasp in given]).encode()).hexdigest()


def given_from_json(text: str, *, outward: bool = False) -> tuple[GivenGrasp, ...]:
    """Parse contacts to judge from the text of a contacts file."""
    sets = contact_sets_from_json(text, Overrides(NO_FRICTION, outward=outward))
    stated = value_of(text)
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
        GivenGrasp(f"given-{i:06}", each.id, _rows(each.positions), _rows(each.normals))
        for i, each in enumerate(sets)
    )


def contacts_text(data: bytes) -> str:
    """Turn the bytes of an npz file into the text of a contacts file."""
    arrays = arrays_of(data, (POINTS, NORMALS, NAMES))
    for name in (POINTS, NORMALS):
        if name not in arrays:
            raise InputError(
                f"the array {name} is missing; expected {POINTS} and {NORMALS}, of shape (n, 4, "
                "3) each"
            )
        array = arrays[name]
        if array.dtype.kind not in "fiu" or not (array.ndim and array.shape[1:] == (FINGERS, 3)):
            raise InputError(
                f"{name}: expected an array of numbers, of shape (n, 4, 3), got {array.dtype} "
                f"{array.shape}"
            )
    points, normals = arrays[POINTS], arrays[NORMALS]
    names = arrays.get(NAMES, np.arange(len(points)))
    if names.ndim != 1 or not len(points) == len(normals) == len(names):
        raise InputError(
            f"{POINTS}, {NORMALS} and {NAMES}: expected arrays of equal length, got shapes "
            f"{points.shape}, {normals.shape} and {names.shape}"
        )
    for name, array in ((POINTS, points), (NORMALS, normals)):
        if not (good := np.isfinite(array).all(axis=(1, 2))).all():
            row = int(good.argmin())
            raise InputError(
                f"{name}[{row}]: expected finite numbers, got NaN or infinity; leave out the "
                f"{np.sum(~good)} rows that have some"
            )
    return given_text(
        [GivenGrasp("", str(name), _rows(p), _rows(n))
         for name, p, n in zip(names, points, normals, strict=True)]
    )  # fmt: skip


def _rows(array: NDArray[np.floating[Any]]) -> tuple[Triple, ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in array)
