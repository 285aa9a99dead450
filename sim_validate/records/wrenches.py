"""A task's wrenches in JSON: what a grasp must hold, as they are.

    {"wrenches": [{"name": "lift", "force_n": [0, 0, -3], "torque_n_m": [0, 0, 0]}, ...]}

Torques are about the centre of mass; forces and torques in the object's frame. A torque may be
left out.
"""

from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from grasp_core.errors import InputError
from grasp_core.files.complaints import record_of
from grasp_core.files.strict_json import place, shown
from sim_validate.files.reading import read_text
from sim_validate.simulation.setup import NamedWrench

MOST_WRENCHES = 10_000
Number = Annotated[float, Field(allow_inf_nan=False)]
Vector = tuple[Number, Number, Number]


class _Given(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    name: str
    force_n: Vector
    torque_n_m: Vector = (0.0, 0.0, 0.0)


class _WrenchFile(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    wrenches: Annotated[list[_Given], Field(min_length=1, max_length=MOST_WRENCHES)]


def wrenches_from_file(path: Path) -> tuple[NamedWrench, ...]:
    """The wrenches of a file.

    Raises:
        InputError: It is not such a file, or a wrench is refused.
    """
    text = read_text(path)
    try:
        return wrenches_from_json(text)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def wrenches_from_json(text: str) -> tuple[NamedWrench, ...]:
    """The wrenches of the text of a file.

    Raises:
        InputError: It is not such a text, or a wrench is refused; the message names the field.
    """
    given = record_of(_WrenchFile, text, "wrench file", nulls=False).wrenches
    names = set[str]()
    for number, each in enumerate(given):
        if each.name in names:
            where = place(["wrenches", number, "name"])
            raise InputError(f"{where}: another wrench has the name {shown(each.name)}; rename one")
        names.add(each.name)
    return tuple(_named(each, i) for i, each in enumerate(given))


def _named(given: _Given, number: int) -> NamedWrench:
    try:
        return NamedWrench(given.name, np.array([*given.force_n, *given.torque_n_m]))
    except InputError as error:
        raise InputError(f"{place(['wrenches', number])}: {error}") from error


def weights(
    weight_n: float, downs: tuple[tuple[float, float, float], ...]
) -> tuple[NamedWrench, ...]:
    """The object's weight at its centre of mass, for each direction of gravity.

    Args:
        weight_n: [N]
        downs: Directions, of any length; along and against each axis if there are none.
    """
    ways = [np.array(down) for down in downs] or [*np.eye(3), *-np.eye(3)]
    return tuple(
        NamedWrench(
            f"weight_{place}",
            np.concatenate([weight_n * way / np.linalg.norm(way), np.zeros(3)]),
        )
        for place, way in enumerate(ways)
    )
